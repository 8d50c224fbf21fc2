// How far trajectories are from the truth.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fleet_tools/evaluate/metrics_trajectory.h"

namespace comap {

/// Absolute trajectory error after one rigid alignment (rotation and translation, no scale) that minimises it.
struct Ate {
  double rmse_m = 0, mean_m = 0, median_m = 0, max_m = 0;
  size_t pairs = 0;
  Pose T_truth_estimate;  ///< the alignment
};

/// The rigid motion that brings the estimates' positions closest to the truth's in the sense of least squares
/// (Horn / Umeyama without scale). Nullopt for fewer than three pairs.
std::optional<Pose> alignRigid(const std::vector<PosePair>& pairs);

/// ATE under a given alignment; `pairs` not empty.
Ate errorUnder(const Pose& T_truth_estimate, const std::vector<PosePair>& pairs);

/// ATE of one trajectory with its own alignment. Nullopt for fewer than three pairs.
std::optional<Ate> absoluteError(const std::vector<PosePair>& pairs);

/// ATE of several robots' trajectories in one map: one alignment for all together. It shows what each robot's own
/// alignment hides: that robots stand wrong to each other. Nullopt for fewer than three pairs in all.
std::optional<Ate> jointError(const std::vector<std::vector<PosePair>>& robots);

/// Relative pose error over a fixed time: E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), Q truth, P estimate.
struct Rpe {
  double translation_rmse_m = 0, rotation_rmse_deg = 0;
  size_t pairs = 0;
};

/// Over each frame and the next one of the pairs. Nullopt if there are fewer than two.
std::optional<Rpe> relativeErrorPerFrame(const std::vector<PosePair>& pairs);

/// From each frame to the one closest to a second later, if it is within 0.02 s of that. Nullopt if there is none.
std::optional<Rpe> relativeErrorPerSecond(const std::vector<PosePair>& pairs);

}  // namespace comap
