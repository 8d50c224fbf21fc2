#include "mapping_core/rgbd/depth_agreement.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

// The nearest depth of 3x3 pixels: beside an edge a pixel's error is the edge's height, not the surface's.
float nearestAround(const Image<float>& depth_m, int u, int v) {
  float nearest = depth_m.at(u, v);
  for (int y = std::max(0, v - 1); y <= std::min(depth_m.height() - 1, v + 1); ++y)
    for (int x = std::max(0, u - 1); x <= std::min(depth_m.width() - 1, u + 1); ++x)
      if (depth_m.at(x, y) > 0) nearest = std::min(nearest, depth_m.at(x, y));
  return nearest;
}

}  // namespace

DepthAgreement compareDepth(const PyramidLevel& from, const PyramidLevel& to, const Pose& T_from_to, double gate_m,
                            const DepthNoiseModel& noise) {
  const Pose T_to_from = T_from_to.inverse();
  const Eigen::Matrix3f r = T_to_from.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_to_from.translation().cast<float>();
  const CameraModel& k = to.camera;
  size_t compared = 0, behind = 0, agree = 0;
  for (int y = 0; y < from.depth_m.height(); ++y)
    for (int x = 0; x < from.depth_m.width(); ++x) {
      const float z = from.depth_m.at(x, y);
      if (z <= 0) continue;
      const Eigen::Vector3f q = r * from.camera.unproject(x, y, z).cast<float>() + t;
      if (q.z() < 0.05f) continue;
      const int u = static_cast<int>(std::lround(k.fx * q.x() / q.z() + k.cx));
      const int v = static_cast<int>(std::lround(k.fy * q.y() / q.z() + k.cy));
      if (!to.depth_m.contains(u, v)) continue;
      const float d = to.depth_m.at(u, v);
      if (d <= 0) continue;
      const float gate = std::max(static_cast<float>(gate_m), 3 * noise.sigma(d));
      ++compared;
      behind += nearestAround(to.depth_m, u, v) > q.z() + gate;
      agree += std::abs(d - q.z()) <= gate;
    }
  if (compared == 0) return {1, 0};
  return {static_cast<double>(behind) / static_cast<double>(compared),
          static_cast<double>(agree) / static_cast<double>(compared)};
}

}  // namespace comap
