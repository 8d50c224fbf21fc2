#include "mapping_core/rgbd/surface_normal.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace comap {

int normalReach(int level) { return std::max(1, 4 >> level); }

Eigen::Vector3f pointAt(const PyramidLevel& level, int x, int y) {
  const float z = level.depth_m.at(x, y);
  const CameraModel& c = level.camera;
  return {(static_cast<float>(x) - static_cast<float>(c.cx)) / static_cast<float>(c.fx) * z,
          (static_cast<float>(y) - static_cast<float>(c.cy)) / static_cast<float>(c.fy) * z, z};
}

Eigen::Vector3f normalAt(const PyramidLevel& level, int x, int y, int reach) {
  if (x < reach || y < reach || x >= level.depth_m.width() - reach || y >= level.depth_m.height() - reach)
    return Eigen::Vector3f::Zero();
  const float z = level.depth_m.at(x, y);
  // Slope allowance: a surface at 80 degrees rises 5.7 times the pixel's footprint.
  const float gate =
      0.01f + 0.006f * z * z + 6.0f * static_cast<float>(reach) * z / static_cast<float>(level.camera.fx);
  const float left = level.depth_m.at(x - reach, y), right = level.depth_m.at(x + reach, y);
  const float up = level.depth_m.at(x, y - reach), down = level.depth_m.at(x, y + reach);
  for (const float d : {left, right, up, down})
    if (d <= 0 || std::abs(d - z) > gate) return Eigen::Vector3f::Zero();
  const Eigen::Vector3f dx = pointAt(level, x + reach, y) - pointAt(level, x - reach, y);
  const Eigen::Vector3f dy = pointAt(level, x, y + reach) - pointAt(level, x, y - reach);
  Eigen::Vector3f n = dx.cross(dy);
  const float length = n.norm();
  if (!(length > 0)) return Eigen::Vector3f::Zero();
  n /= length;
  const Eigen::Vector3f p = pointAt(level, x, y);
  const float facing = n.dot(p) / p.norm();
  if (std::abs(facing) < 0.12f) return Eigen::Vector3f::Zero();  // grazing beyond 83 degrees: depth is noise
  return facing > 0 ? Eigen::Vector3f(-n) : n;
}

}  // namespace comap
