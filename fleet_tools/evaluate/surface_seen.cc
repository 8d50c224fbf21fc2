#include "fleet_tools/evaluate/surface_seen.h"

#include <cmath>

#include "fleet_tools/synth/synth_parallel.h"

namespace comap {

void SurfaceSeen::add(const CameraModel& camera, const DepthImage& depth, const Pose& T_truth_cam, int threads) {
  const Pose T_cam_truth = T_truth_cam.inverse();
  const Eigen::Matrix3f R = T_cam_truth.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_cam_truth.translation().cast<float>();
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  constexpr size_t kBatch = 16384;
  parallelFor(static_cast<int>((points_.size() + kBatch - 1) / kBatch), threads, [&](int batch) {
    const size_t first = static_cast<size_t>(batch) * kBatch;
    for (size_t i = first; i < std::min(points_.size(), first + kBatch); ++i) {
      if (seen_[i]) continue;
      const Eigen::Vector3f p = R * points_[i] + t;
      if (p.z() < kSeenNearest_m || p.z() > kSeenFarthest_m) continue;
      const auto u = static_cast<int>(std::lround(fx * p.x() / p.z() + cx));
      const auto v = static_cast<int>(std::lround(fy * p.y() / p.z() + cy));
      if (!depth.contains(u, v) || depth.at(u, v) == 0) continue;
      seen_[i] = std::abs(static_cast<float>(depth.at(u, v) / kDepthUnitsPerMetre) - p.z()) <= kSeenWithin_m;
    }
  });
}

}  // namespace comap
