// What a run leaves for people and tools: trajectories, map.ply, report.json, pictures and report.html.
#pragma once

#include <nlohmann/json.hpp>

#include "fleet_tools/replay/replay.h"

namespace comap {

/// Writes everything beside the store of a finished replay and returns report.json's content.
Result<nlohmann::json> writeRunOutputs(const ReplayOptions& options, const ReplayOutcome& outcome);

}  // namespace comap
