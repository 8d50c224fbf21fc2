#include "mapping_core/rgbd/seeded_alignment.h"

#include <algorithm>

namespace comap {

Pose turned(double pitch_rad, double yaw_rad) {
  Vector6d twist;
  twist << 0, 0, 0, pitch_rad, yaw_rad, 0;
  return Pose::exp(twist);
}

double fitScore(double inlier_ratio, double overlap) { return inlier_ratio * std::min(1.0, 2 * overlap); }

Alignment alignFromSeeds(const ReferenceView& reference, const Pyramid& frame, std::span<const Pose> seeds,
                         const AlignmentOptions& options, PointResiduals& workspace) {
  Alignment best;
  double best_score = -1;
  for (const Pose& seed : seeds) {
    const Alignment alignment = align(reference, frame, seed, options, workspace);
    const double score = alignment.solved ? fitScore(alignment.inlier_ratio, alignment.overlap) : 0;
    if (score > best_score) {
      best_score = score;
      best = alignment;
    }
  }
  return best;
}

Alignment alignFromAround(const ReferenceView& reference, const Pyramid& reference_pyramid, const Pyramid& frame,
                          const WideSearch& search, PointResiduals& workspace, RotationWorkspace& rotation_workspace) {
  AlignmentOptions options;
  options.noise = search.noise;
  options.iterations = {15, 5};
  options.coarse_gate_m = 0.6f;
  options.distance_gate_m = 0.15f;
  options.coarse_extra_sigma_m = 0.08f;
  const double a = search.seed_rad;
  std::vector<Pose> seeds{Pose(), turned(0, a), turned(0, -a), turned(a, 0), turned(-a, 0)};
  const PyramidLevel& from = reference_pyramid[search.level];
  const RotationAlignment rotation = alignRotation(from.camera, from.grey, frame[search.level].grey,
                                                   Eigen::Matrix3d::Identity(), {}, rotation_workspace);
  if (rotation.usable) seeds.emplace_back(rotation.R_previous_current, Eigen::Vector3d::Zero());
  return alignFromSeeds(reference, frame, seeds, options, workspace);
}

}  // namespace comap
