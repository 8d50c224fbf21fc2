// Alignment of views whose guess may be far off: from several starting poses, the best end counts.
#pragma once

#include <span>

#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/rotation_alignment.h"

namespace comap {

/// A camera turned up (pitch) and to the right (yaw), radians; a starting pose.
Pose turned(double pitch_rad, double yaw_rad);

/// How well one view fits another, 0..1: the share of points that agree, less if few are in view at all.
double fitScore(double inlier_ratio, double overlap);

/// align() from each of `seeds` (T_ref_cur); the end with the best score, the first of equals.
Alignment alignFromSeeds(const ReferenceView& reference, const Pyramid& frame, std::span<const Pose> seeds,
                         const AlignmentOptions& options, PointResiduals& workspace);

/// What a robot that is lost has: the reference's level where brightness is coarsest, and how far to turn for a start.
struct WideSearch {
  size_t level = 0;       ///< of both pyramids; the reference's coarsest
  double seed_rad = 0.1;  ///< yaw and pitch of the starting poses beside the reference's own
  DepthNoiseModel noise;
};

/// alignFromSeeds() from the reference's own pose, from those turned to its four sides, and from the turn that the
/// pictures alone show: for views that are within some 0.5 m of each other. `reference_pyramid` is what `reference` was
/// made of.
Alignment alignFromAround(const ReferenceView& reference, const Pyramid& reference_pyramid, const Pyramid& frame,
                          const WideSearch& search, PointResiduals& workspace, RotationWorkspace& rotation_workspace);

}  // namespace comap
