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

}  // namespace comap
