#include "mapping_core/rgbd/reference_view.h"

#include <algorithm>
#include <cmath>

#include "mapping_core/rgbd/row_workers.h"
#include "mapping_core/rgbd/surface_normal.h"

namespace comap {
namespace {

constexpr size_t kLanes = 8;

// Scharr's operator: the direction of an edge is right to a degree or so, whichever way it runs.
Eigen::Vector2f gradientAt(const Image<float>& grey, int x, int y) {
  const float* up = grey.row(y - 1) + x;
  const float* mid = grey.row(y) + x;
  const float* down = grey.row(y + 1) + x;
  const float gx = 3 * (up[1] - up[-1] + down[1] - down[-1]) + 10 * (mid[1] - mid[-1]);
  const float gy = 3 * (down[-1] - up[-1] + down[1] - up[1]) + 10 * (down[0] - up[0]);
  return {gx / 32, gy / 32};
}

void append(ReferencePoints& points, const PickedPoint& point) {
  points.x.push_back(point.p.x());
  points.y.push_back(point.p.y());
  points.z.push_back(point.p.z());
  points.nx.push_back(point.n.x());
  points.ny.push_back(point.n.y());
  points.nz.push_back(point.n.z());
  points.grey.push_back(point.grey);
  points.gx.push_back(point.gradient.x());
  points.gy.push_back(point.gradient.y());
  points.sigma_m.push_back(point.sigma_m);
}

float medianGradientSquare(const ReferencePoints& points) {
  if (points.count == 0) return 0;
  std::vector<float> squares(points.count);
  for (size_t i = 0; i < points.count; ++i) squares[i] = points.gx[i] * points.gx[i] + points.gy[i] * points.gy[i];
  const auto middle = squares.begin() + static_cast<long>(points.count / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle;
}

// The cell of so many pixels whose first one is (cx, cy).
PickedPoint pickPoint(const PyramidLevel& level, int cx, int cy, int cell, int reach, const DepthNoiseModel& noise) {
  int best_x = -1, best_y = -1;
  float best = -1;
  for (int y = cy; y < cy + cell; ++y)
    for (int x = cx; x < cx + cell; ++x) {
      if (level.depth_m.at(x, y) <= 0) continue;
      const float g = gradientAt(level.grey, x, y).squaredNorm();
      if (g > best) {
        best = g;
        best_x = x;
        best_y = y;
      }
    }
  PickedPoint point;
  if (best_x < 0) return point;
  point.p = pointAt(level, best_x, best_y);
  point.n = normalAt(level, best_x, best_y, reach);
  point.grey = level.grey.at(best_x, best_y);
  point.gradient = gradientAt(level.grey, best_x, best_y);
  const float along = point.n.isZero() ? 1.0f : std::abs(point.n.dot(point.p)) / point.p.norm();
  point.sigma_m = std::max(noise.floor_m, along * noise.sigma(point.p.z()));
  return point;
}

void pickPoints(const PyramidLevel& level, int number, const ReferenceOptions& options, const DepthNoiseModel& noise,
                RowWorkers* workers, std::vector<PickedPoint>& picked, ReferencePoints& points) {
  points.camera = level.camera;
  points.level = number;
  for (auto* column : {&points.x, &points.y, &points.z, &points.nx, &points.ny, &points.nz, &points.grey, &points.gx,
                       &points.gy, &points.sigma_m})
    column->clear();
  const int width = level.grey.width(), height = level.grey.height();
  const int cell =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(width) * height / options.max_points))));
  const int reach = normalReach(number);
  constexpr int kBorder = 2;
  const int columns = std::max(0, (width - 2 * kBorder) / cell), rows = std::max(0, (height - 2 * kBorder) / cell);
  picked.resize(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  shareRows(workers, rows, [&](int begin, int end) {
    auto point = picked.begin() + static_cast<long>(begin) * columns;
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < columns; ++x)
        *point++ = pickPoint(level, kBorder + x * cell, kBorder + y * cell, cell, reach, noise);
  });
  for (const PickedPoint& point : picked)
    if (point.p.z() > 0) append(points, point);
  points.count = points.x.size();
  points.median_gradient_square = medianGradientSquare(points);
  PickedPoint behind;  // the camera: never seen
  behind.p.z() = -1;
  behind.sigma_m = 1;
  while (points.x.size() % kLanes != 0) append(points, behind);
}

}  // namespace

ReferenceView buildReference(const Pyramid& pyramid, const ReferenceOptions& options, const DepthNoiseModel& noise) {
  ReferenceView view;
  std::vector<PickedPoint> workspace;
  buildReference(pyramid, options, noise, nullptr, workspace, view);
  return view;
}

void buildReference(const Pyramid& pyramid, const ReferenceOptions& options, const DepthNoiseModel& noise,
                    RowWorkers* workers, std::vector<PickedPoint>& workspace, ReferenceView& view) {
  const int coarsest = std::min(options.coarsest_level, static_cast<int>(pyramid.size()) - 1);
  view.levels.resize(static_cast<size_t>(std::max(0, coarsest - options.finest_level + 1)));
  for (size_t i = 0; i < view.levels.size(); ++i) {
    const int level = coarsest - static_cast<int>(i);
    pickPoints(pyramid[static_cast<size_t>(level)], level, options, noise, workers, workspace, view.levels[i]);
  }
}

}  // namespace comap
