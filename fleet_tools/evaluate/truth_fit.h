// Whether the truth deserves its name: how well the depth pictures of a run fit the true poses, and how well the
// estimated ones. Where the estimate fits far better, its error says more about the truth.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mapping_core/rgbd/point_residuals.h"
#include "mapping_core/verify/keyframe_view.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

/// Of one keyframe to the robot's next one.
struct FitStep {
  KeyframeId from, to;
  double from_s = 0, to_s = 0;                 ///< of the recording, since the robot's first keyframe
  double truth_sigma = 0, estimate_sigma = 0;  ///< misfit() of the depth pictures
  double apart_m = 0, apart_deg = 0;           ///< between the true and the estimated step
};

struct TruthFit {
  std::vector<FitStep> steps;
  /// One fits better than the other if its misfit is less by this factor, which no noise of the depths makes.
  static constexpr double kFactor = 1.5;
  std::vector<const FitStep*> contradicted() const;  ///< where the estimate fits better; the worst first
  size_t truthFitsBetter() const;
};

/// Root mean square of the distances between the surfaces of `from` and the depths of `to`, in sigma of the depth
/// noise, each counted as five at most; points without a partner within 10 cm are left out. Nullopt if fewer than 100
/// points can be compared. `workspace` is memory only.
std::optional<double> misfit(const KeyframeView& from, const KeyframeView& to, const Pose& T_from_to,
                             const DepthNoiseModel& noise, PointResiduals& workspace);

/// Reads the keyframes of the store `path`; `truths` are trajectory files by robot. Errors of the store and the files.
Result<TruthFit> fitTruth(const std::string& path, const std::map<std::string, std::string>& truths);

nlohmann::json toJson(const TruthFit& fit);
/// For a terminal: one line, or two if the truth is contradicted somewhere.
std::string fitText(const TruthFit& fit);

}  // namespace comap
