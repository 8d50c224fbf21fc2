// Alignment of views whose guess may be far off: from several starting poses, the best end counts.
#pragma once

#include <span>

#include "mapping_core/rgbd/alignment.h"

namespace comap {

/// A camera turned up (pitch) and to the right (yaw), radians; a starting pose.
Pose turned(double pitch_rad, double yaw_rad);

/// How well one view fits another, 0..1: the share of points that agree, less if few are in view at all.
double fitScore(double inlier_ratio, double overlap);

/// align() from each of `seeds` (T_ref_cur); the end with the best score, the first of equals.
Alignment alignFromSeeds(const ReferenceView& reference, const Pyramid& frame, std::span<const Pose> seeds,
                         const AlignmentOptions& options, PointResiduals& workspace);

}  // namespace comap
