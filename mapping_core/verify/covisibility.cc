#include "mapping_core/verify/covisibility.h"

#include <algorithm>

namespace comap {
namespace {

bool wellDetermined(const Alignment& alignment, const CovisibilityOptions& options) {
  return alignment.solved && alignment.inlier_ratio >= options.inlier_ratio &&
         alignment.degeneracy >= options.degeneracy;
}

bool near(const Pose& a, const Pose& b, double metres, double radians) {
  const Pose difference = a.inverse() * b;
  return difference.translation().norm() <= metres && difference.angle() <= radians;
}

}  // namespace

std::vector<size_t> covisibleWith(const PlacedSketch& query, std::span<const PlacedSketch> others,
                                  const CovisibilityOptions& options, const ComparisonOptions& comparison) {
  std::vector<std::pair<double, size_t>> found;
  for (size_t i = 0; i < others.size(); ++i) {
    if (others[i].sketch->id == query.sketch->id) continue;
    const Pose T_query_other = query.T_map_cam.inverse() * others[i].T_map_cam;
    if (roughOverlap(*query.sketch, *others[i].sketch, T_query_other) < options.overlap) continue;
    const double overlap = agreedShare(*query.sketch, *others[i].sketch, T_query_other, comparison);
    if (overlap >= options.overlap) found.emplace_back(-overlap, i);
  }
  std::sort(found.begin(), found.end());
  if (found.size() > options.per_keyframe) found.resize(options.per_keyframe);
  std::vector<size_t> result;
  for (const auto& [overlap, i] : found) result.push_back(i);
  return result;
}

std::optional<Edge> alignCovisible(const KeyframeView& from, const KeyframeView& to, const Pose& T_from_to,
                                   const CovisibilityOptions& options, PointResiduals& workspace) {
  AlignmentOptions alignment;
  alignment.noise = options.noise;
  alignment.iterations = {8, 8};
  alignment.coarse_gate_m = 0.15f;
  alignment.distance_gate_m = 0.08f;
  const Alignment forth = align(from.fine, to.pyramid, T_from_to, alignment, workspace);
  if (!wellDetermined(forth, options)) return std::nullopt;
  if (!near(T_from_to, forth.T_ref_cur, options.explained_m, options.explained_rad)) return std::nullopt;
  const Alignment back = align(to.fine, from.pyramid, forth.T_ref_cur.inverse(), alignment, workspace);
  if (!wellDetermined(back, options)) return std::nullopt;
  const Pose T_back = back.T_ref_cur.inverse();
  if (!near(forth.T_ref_cur, T_back, options.round_trip_m, options.round_trip_rad)) return std::nullopt;
  return Edge{from.id, to.id, EdgeKind::kCovisibility, interpolate(forth.T_ref_cur, T_back, 0.5), forth.information};
}

}  // namespace comap
