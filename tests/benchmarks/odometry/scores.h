// What a run over a sequence comes to: error against the truth, and time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "tests/benchmarks/quantile.h"

namespace comap {

/// Relative error over one second of the recording: each pair against the one closest to a second later, if it is
/// within 0.02 s of that.
struct RelativeError {
  double translation_median_m = 0, translation_worst_m = 0;
  double rotation_median_deg = 0, rotation_worst_deg = 0;
  size_t spans = 0;
};
RelativeError relativeErrorOverSecond(const std::vector<PosePair>& pairs);

/// Drift in percent of the path: the mean, over all starts, of the translation error at the end of a stretch of true
/// path of `stretch_m`, by its length. Nullopt if the path is shorter than that.
std::optional<double> driftPercent(const std::vector<PosePair>& pairs, double stretch_m);

/// Length of the true path, metres.
double pathLength_m(const std::vector<PosePair>& pairs);

struct Row {
  std::string sequence, method;
  size_t frames = 0, keyframes = 0, poor = 0, lost = 0, pairs = 0;
  std::vector<double> cpu_ms, wall_ms;  ///< a frame each
  double ate_rmse_m = 0, path_m = 0;
  RelativeError relative;
  std::optional<double> drift_percent;
};

}  // namespace comap
