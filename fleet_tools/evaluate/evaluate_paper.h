// Merges of a run of the paper mode against the truth.
#pragma once

#include "fleet_tools/evaluate/evaluate_closures.h"

namespace comap {

/// Scores `merges` of the report of such a run; a merge is false if the match that caused it is farther from the truth
/// than `bounds`, and none is ever taken back. What the mode does not tell stays 0. kBadData if the report lacks what
/// it needs; errors of the truth's files.
Result<ClosureScore> evaluatePaperMerges(const nlohmann::json& report, const std::map<std::string, std::string>& truths,
                                         const ClosureBounds& bounds = {});

}  // namespace comap
