// What a run of the paper mode leaves: trajectories, map.ply, pictures, frames.csv, report.json, report.html.
#pragma once

#include <nlohmann/json.hpp>

#include "fleet_tools/replay/replay.h"
#include "mapping_core/paper/paper_core.h"

namespace comap {

/// What the robots' side of a run tells.
struct PaperRobot {
  std::string name;
  uint64_t uplink_bytes = 0;
  uint32_t frames = 0, damaged_frames = 0;
  double duration_s = 0;
};

struct PaperOutcome {
  std::vector<PaperRobot> robots;
  std::string device;
  double wall_s = 0;
};

/// Writes all files of the run and returns report.json's content; its keys are those of a graph run where both have
/// the thing.
Result<nlohmann::json> writePaperOutputs(const ReplayOptions& options, const PaperCore& core,
                                         const PaperOutcome& outcome);

}  // namespace comap
