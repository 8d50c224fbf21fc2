#include "mapping_core/rgbd/reference_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace comap {
namespace {

constexpr size_t kLanes = 8;

Eigen::Vector3f pointAt(const PyramidLevel& level, int x, int y) {
  const float z = level.depth_m.at(x, y);
  const CameraModel& c = level.camera;
  return {(static_cast<float>(x) - static_cast<float>(c.cx)) / static_cast<float>(c.fx) * z,
          (static_cast<float>(y) - static_cast<float>(c.cy)) / static_cast<float>(c.fy) * z, z};
}

// Central differences over `reach` pixels; zero where a neighbour is missing or beyond a jump.
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

float gradientSquared(const Image<float>& grey, int x, int y) {
  const float gx = grey.at(x + 1, y) - grey.at(x - 1, y);
  const float gy = grey.at(x, y + 1) - grey.at(x, y - 1);
  return gx * gx + gy * gy;
}

void append(ReferencePoints& points, const Eigen::Vector3f& p, const Eigen::Vector3f& n, float grey, float sigma) {
  points.x.push_back(p.x());
  points.y.push_back(p.y());
  points.z.push_back(p.z());
  points.nx.push_back(n.x());
  points.ny.push_back(n.y());
  points.nz.push_back(n.z());
  points.grey.push_back(grey);
  points.sigma_m.push_back(sigma);
}

ReferencePoints pickPoints(const PyramidLevel& level, int number, const ReferenceOptions& options,
                           const DepthNoiseModel& noise) {
  ReferencePoints points;
  points.camera = level.camera;
  points.level = number;
  const int width = level.grey.width(), height = level.grey.height();
  const int cell =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(width) * height / options.max_points))));
  // Normals over about the same piece of surface at every level: 4 pixels of full resolution to each side.
  const int reach = std::max(1, 4 >> number);
  constexpr int kBorder = 2;
  for (int cy = kBorder; cy + cell <= height - kBorder; cy += cell) {
    for (int cx = kBorder; cx + cell <= width - kBorder; cx += cell) {
      int best_x = -1, best_y = -1;
      float best = -1;
      for (int y = cy; y < cy + cell; ++y)
        for (int x = cx; x < cx + cell; ++x) {
          if (level.depth_m.at(x, y) <= 0) continue;
          const float g = gradientSquared(level.grey, x, y);
          if (g > best) {
            best = g;
            best_x = x;
            best_y = y;
          }
        }
      if (best_x < 0) continue;
      const Eigen::Vector3f p = pointAt(level, best_x, best_y);
      const Eigen::Vector3f n = normalAt(level, best_x, best_y, reach);
      const float along = n.isZero() ? 1.0f : std::abs(n.dot(p)) / p.norm();
      append(points, p, n, level.grey.at(best_x, best_y), std::max(noise.floor_m, along * noise.sigma(p.z())));
    }
  }
  points.count = points.x.size();
  while (points.x.size() % kLanes != 0) append(points, {0, 0, -1}, {0, 0, 0}, 0, 1);  // behind the camera: never seen
  return points;
}

}  // namespace

ReferenceView buildReference(const Pyramid& pyramid, const ReferenceOptions& options, const DepthNoiseModel& noise) {
  ReferenceView view;
  const int coarsest = std::min(options.coarsest_level, static_cast<int>(pyramid.size()) - 1);
  for (int l = coarsest; l >= options.finest_level; --l)
    view.levels.push_back(pickPoints(pyramid[static_cast<size_t>(l)], l, options, noise));
  return view;
}

}  // namespace comap
