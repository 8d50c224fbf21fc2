// Several runs side by side, with the median and the worst of each number.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fleet_tools/evaluate/evaluate.h"

namespace comap {

struct RunColumn {
  const char* key;   ///< in JSON
  const char* head;  ///< for people
  bool more_is_worse;
  int decimals;
};
inline constexpr std::array<RunColumn, 8> kRunColumns = {{{"worst_ate_rmse_m", "ATE own", true, 4},
                                                          {"joint_ate_rmse_m", "ATE joint", true, 4},
                                                          {"surface_mean_m", "surface", true, 4},
                                                          {"completeness_2cm", "complete", false, 3},
                                                          {"precision", "precision", false, 3},
                                                          {"keyframe_recall", "recall", false, 3},
                                                          {"false_merges", "false merges", true, 0},
                                                          {"first_merge_s", "first merge s", true, 1}}};

/// The numbers of one run, in the order of kRunColumns; none where the run has none. "ATE own": of its worst robot.
using RunNumbers = std::array<std::optional<double>, kRunColumns.size()>;
RunNumbers numbersOf(const RunEvaluation& evaluation);

struct RunSummary {
  RunNumbers median;  ///< of the runs that have the number; of an even count the mean of the middle two
  RunNumbers worst;   ///< none also if any run has none while another one has: nothing is worse than no result
};
RunSummary summarise(const std::vector<RunNumbers>& runs);

std::string tableOf(const std::vector<std::string>& names, const std::vector<RunNumbers>& runs);
nlohmann::json toJson(const RunNumbers& numbers);

/// RUN itself if it holds report.json, else its folders seed-1, seed-2 ... that do; kUnreachable if there is none.
Result<std::vector<std::string>> runsIn(const std::string& run);

}  // namespace comap
