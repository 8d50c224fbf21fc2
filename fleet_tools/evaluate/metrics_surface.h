// How far a map's points are from the true surface, and how much of it they cover.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "fleet_tools/export/ply.h"
#include "protocol/types/pose.h"

namespace comap {

/// Within this distance of the nearest truth point, error is measured along that point's normal (point to plane): it is
/// the diagonal of the 15 mm cubes that hold one truth point each, so that how densely the truth is sampled does not
/// count as error. Beyond it, and if the truth has no normals, the error is the distance to the nearest point.
inline constexpr float kPlaneReach_m = 0.026f;
inline constexpr float kCompleteWithin_m = 0.02f;

struct SurfaceScore {
  double accuracy_mean_m = 0, accuracy_median_m = 0, accuracy_p90_m = 0;  ///< over map points
  double point_mean_m = 0;           ///< over map points, plain distance to the nearest truth point
  double completeness_2cm = 0;       ///< share of truth points with a map point within 2 cm
  double completeness_seen_2cm = 0;  ///< the same of those that were seen
  double covered_seen_2cm = 0;       ///< of those, the share within 2 cm of a map point's disc; 0 without radii
  size_t map_points = 0, truth_points = 0, truth_points_seen = 0;
};

/// `T_truth_map` brings the map's points into the truth's frame. Neither cloud may be empty. `seen`: one per truth
/// point, not 0 = seen; empty = not known, then truth_points_seen is 0.
SurfaceScore scoreSurface(const PlyPoints& map, const Pose& T_truth_map, const PlyPoints& truth, int threads,
                          std::span<const uint8_t> seen = {});

}  // namespace comap
