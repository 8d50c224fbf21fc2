#include "mapping_core/verify/merge_check.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace comap {
namespace {

constexpr double kFarthest_m = 8;  // cameras farther apart than that share too little at the ranges of such sensors
constexpr double kSameSide_rad = 1.05;  // 60 degrees: beyond, surfaces show other sides or are seen too slanted

}  // namespace

void Evidence::add(const Comparison& comparison) {
  ++views;
  cells += comparison.agree + comparison.through;
  through += comparison.through;
  discoloured += comparison.discoloured;
}

void Evidence::add(const Evidence& other) {
  views += other.views;
  cells += other.cells;
  through += other.through;
  discoloured += other.discoloured;
}

double roughOverlap(const Sketch& a, const Sketch& b, const Pose& T_a_b) {
  if (T_a_b.translation().norm() > kFarthest_m || T_a_b.angle() > kSameSide_rad) return 0;
  constexpr int kStep = 8;
  const Pose T_b_a = T_a_b.inverse();
  int all = 0, seen = 0;
  for (int y = kStep / 2; y < a.depth_m.height(); y += kStep)
    for (int x = kStep / 2; x < a.depth_m.width(); x += kStep) {
      const float z = a.depth_m.at(x, y);
      if (z <= 0) continue;
      ++all;
      const Eigen::Vector3d q = T_b_a * a.camera.unproject(x, y, static_cast<double>(z));
      if (q.z() < 0.2) continue;
      const Eigen::Vector2d p = b.camera.project(q);
      seen += b.depth_m.contains(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    }
  return all > 0 ? static_cast<double>(seen) / all : 0;
}

Evidence compareViews(const Sketch& a, const Sketch& b, const Pose& T_a_b, const MergeCheckOptions& options) {
  Evidence evidence;
  const auto ask = [&](const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen) {
    const Comparison comparison = compareSketches(surfaces, seen, T_surfaces_seen, options.comparison);
    const double overlap = static_cast<double>(comparison.visible) / static_cast<double>(surfaces.depth_m.size());
    if (overlap >= options.view_overlap) evidence.add(comparison);
  };
  ask(a, b, T_a_b);
  ask(b, a, T_a_b.inverse());
  return evidence;
}

Evidence weighHypothesis(std::span<const PlacedSketch> a, std::span<const PlacedSketch> b, const Pose& T_a_b,
                         const MergeCheckOptions& options) {
  std::vector<std::pair<size_t, size_t>> pairs;
  const auto between = [&](size_t i, size_t j) { return a[i].T_map_cam.inverse() * T_a_b * b[j].T_map_cam; };
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t j = 0; j < b.size(); ++j)
      if (roughOverlap(*a[i].sketch, *b[j].sketch, between(i, j)) >= options.view_overlap) pairs.emplace_back(i, j);
  Evidence evidence;
  const size_t asked = std::min(pairs.size(), options.most_pairs);
  for (size_t n = 0; n < asked; ++n) {
    const auto [i, j] = pairs[n * pairs.size() / asked];
    evidence.add(compareViews(*a[i].sketch, *b[j].sketch, between(i, j), options));
  }
  return evidence;
}

}  // namespace comap
