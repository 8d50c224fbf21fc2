// Which part of a true surface some cameras have measured.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

inline constexpr float kSeenNearest_m = 0.3f, kSeenFarthest_m = 5.0f;  ///< depths that are fused
inline constexpr float kSeenWithin_m = 0.05f;  ///< between a point's depth and the one measured at its pixel

class SurfaceSeen {
 public:
  /// `points` must outlive this; metres, in the truth's frame.
  explicit SurfaceSeen(std::span<const Eigen::Vector3f> points) : points_(points), seen_(points.size(), 0) {}

  /// Marks the points that this depth image has measured.
  void add(const CameraModel& camera, const DepthImage& depth, const Pose& T_truth_cam, int threads);

  /// One per point: 1 = seen.
  const std::vector<uint8_t>& seen() const { return seen_; }

 private:
  std::span<const Eigen::Vector3f> points_;
  std::vector<uint8_t> seen_;
};

}  // namespace comap
