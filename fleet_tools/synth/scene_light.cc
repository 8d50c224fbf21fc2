#include "fleet_tools/synth/scene_light.h"

#include <algorithm>
#include <cmath>

#include "fleet_tools/synth/scene_bvh.h"
#include "fleet_tools/synth/synth_parallel.h"

namespace comap {
namespace {

using Eigen::Vector3f;

constexpr float kSpacing_m = 0.08f;
constexpr float kOff_m = 0.004f;   // start of rays above the surface
constexpr float kNearby_m = 0.9f;  // what is nearer than this shades a corner
constexpr float kLampRadius_m = 0.18f;
constexpr int kSkyRays = 32;

// Cosine-distributed directions around z, evenly spread by the golden angle.
Vector3f skyDirection(int i) {
  const float r = std::sqrt((static_cast<float>(i) + 0.5f) / kSkyRays);
  const float angle = 2.39996323f * static_cast<float>(i);
  return {r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - r * r)};
}

float brightness(const Scene& scene, const SceneBvh& bvh, const Vector3f& point, const Vector3f& normal) {
  const Vector3f from = point + kOff_m * normal;
  Eigen::Matrix3f frame;
  const Vector3f helper = std::abs(normal.x()) < 0.7f ? Vector3f::UnitX() : Vector3f::UnitY();
  frame.col(2) = normal;
  frame.col(0) = normal.cross(helper).normalized();
  frame.col(1) = normal.cross(frame.col(0));
  int open = 0;
  for (int i = 0; i < kSkyRays; ++i) open += bvh.blocked(from, frame * skyDirection(i), kNearby_m) ? 0 : 1;
  float sum = 0.30f + 0.38f * static_cast<float>(open) / kSkyRays;

  for (const auto& lamp : scene.lamps) {
    if (normal.dot(lamp.position - point) <= 0) continue;
    float seen = 0;
    for (int corner = 0; corner < 4; ++corner) {
      const Vector3f offset(corner % 2 == 0 ? -kLampRadius_m : kLampRadius_m,
                            corner / 2 == 0 ? -kLampRadius_m : kLampRadius_m, 0);
      const Vector3f to = lamp.position + offset - from;
      if (!bvh.blocked(from, to, 0.98f)) seen += 0.25f;
    }
    const Vector3f to = lamp.position - point;
    const float cosine = std::max(0.0f, normal.dot(to.normalized()));
    sum += seen * lamp.strength * 0.75f * cosine / (0.6f + 0.25f * to.squaredNorm());
  }
  return std::min(sum, 1.25f);
}

}  // namespace

LightMap::LightMap(const Scene& scene, int threads) {
  size_t count = 0;
  struct Task {
    int primitive, face;
    size_t grid;
  };
  std::vector<Task> tasks;
  for (size_t p = 0; p < scene.primitives.size(); ++p) {
    const auto& primitive = scene.primitives[p];
    first_grid_.push_back(grids_.size());
    for (int face = 0; face < faceCount(primitive.shape); ++face) {
      const auto size = sizeOf(primitive, face);
      const bool curved = primitive.shape != Shape::kBox && face == 0;
      const int least = curved ? 8 : 2;
      Grid grid;
      grid.columns = std::clamp(static_cast<int>(std::ceil(size.x() / kSpacing_m)) + 1, least, 256);
      grid.rows = std::clamp(static_cast<int>(std::ceil(size.y() / kSpacing_m)) + 1, curved ? 4 : 2, 256);
      grid.wraps = curved;
      grid.first = count;
      count += static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows);
      tasks.push_back({static_cast<int>(p), face, grids_.size()});
      grids_.push_back(grid);
    }
  }
  values_.resize(count);

  const SceneBvh bvh(scene.primitives);
  parallelFor(static_cast<int>(tasks.size()), threads, [&](int i) {
    const auto& task = tasks[static_cast<size_t>(i)];
    const auto& primitive = scene.primitives[static_cast<size_t>(task.primitive)];
    const Grid& grid = grids_[task.grid];
    const auto size = sizeOf(primitive, task.face);
    // Keep a little off the rim, where neighbours touch.
    const float rim_a = std::min(0.2f, 0.01f / size.x()), rim_b = std::min(0.2f, 0.01f / size.y());
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const float a = static_cast<float>(column) / static_cast<float>(grid.wraps ? grid.columns : grid.columns - 1);
        const float b = static_cast<float>(row) / static_cast<float>(grid.rows - 1);
        Vector3f normal;
        const Vector3f local = pointOf(primitive, task.face, grid.wraps ? a : std::clamp(a, rim_a, 1 - rim_a),
                                       std::clamp(b, rim_b, 1 - rim_b), normal);
        const Eigen::Matrix3f R_world_local = primitive.R_local_world.transpose();
        values_[grid.first + static_cast<size_t>(row * grid.columns + column)] =
            brightness(scene, bvh, primitive.centre + R_world_local * local, R_world_local * normal);
      }
    }
  });
}

float LightMap::at(int primitive, const SurfaceSpot& spot) const {
  const Grid& grid = grids_[first_grid_[static_cast<size_t>(primitive)] + static_cast<size_t>(spot.face)];
  const float x = std::clamp(spot.a, 0.0f, 1.0f) * static_cast<float>(grid.wraps ? grid.columns : grid.columns - 1);
  const float y = std::clamp(spot.b, 0.0f, 1.0f) * static_cast<float>(grid.rows - 1);
  const int x0 = std::min(static_cast<int>(x), grid.wraps ? grid.columns - 1 : grid.columns - 2);
  const int y0 = std::min(static_cast<int>(y), grid.rows - 2);
  const int x1 = grid.wraps ? (x0 + 1) % grid.columns : x0 + 1;
  const float s = x - static_cast<float>(x0), t = y - static_cast<float>(y0);
  const auto value = [&](int i, int j) { return values_[grid.first + static_cast<size_t>(j * grid.columns + i)]; };
  return (value(x0, y0) * (1 - s) + value(x1, y0) * s) * (1 - t) +
         (value(x0, y0 + 1) * (1 - s) + value(x1, y0 + 1) * s) * t;
}

}  // namespace comap
