// The truth that runs of both modes are measured by: who has one, and whether it can be used.
#pragma once

#include "fleet_tools/replay/replay_compare.h"

namespace comap {

/// NAME=FILE of each; kWrongUse for another form, or a name given twice.
Result<std::map<std::string, std::string>> parseTruths(const std::vector<std::string>& texts);

/// Of each of the robots the given file, else groundtruth.txt beside its source if there is one; and the surface.
RunTruth truthOf(const std::vector<ReplayRobot>& robots, const RunTruth& given);

/// Reads all that a comparison will read hours later: an error names the option. kWrongUse for a truth of no robot, a
/// surface that no trajectory can be aligned to, or more cameras than the paper mode takes.
Result<void> checkCompare(const std::vector<ReplayRobot>& robots, const RunTruth& given);

}  // namespace comap
