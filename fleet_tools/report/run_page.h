// report.html of a run, from what stands in its folder.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Writes `run`/report.html from report.json, the trajectories, the pictures and, once it was evaluated, errors.csv.
/// What is not there is left out of the page, but for report.json. kUnreachable, kBadData.
Result<void> writeRunPage(const std::string& run);

}  // namespace comap
