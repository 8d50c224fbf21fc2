#include "edge_agent/map_cache/map_search.h"

#include <algorithm>

#include "mapping_core/rgbd/seeded_alignment.h"

namespace comap {
namespace {

bool apart(const Pose& a, const Pose& b, double distance_m, double angle_rad) {
  const Pose between = a.inverse() * b;
  return between.translation().norm() > distance_m || between.angle() > angle_rad;
}

// Accepted before refused, then by how well it fits.
bool better(const Registration& a, const Registration& b) {
  if (a.accepted != b.accepted) return a.accepted;
  return fitScore(a.inlier_ratio, a.overlap) > fitScore(b.inlier_ratio, b.overlap);
}

}  // namespace

bool MapSearch::attempt(const TileCache& cache, MapRegistration& registration, const Pyramid& live,
                        const FernCode& code, const Pose& T_odom_cam, const std::optional<Pose>& T_map_guess) {
  const Pose motion = T_odom_before_.inverse() * T_odom_cam;
  T_odom_before_ = T_odom_cam;
  if (views_ == 0) {
    place_ = searchAll(cache, registration, live, code, T_map_guess);
    if (!place_.accepted) return false;
    T_map_first_ = place_.T_map_cam;
  } else {
    const Pose T_map_expected = place_.T_map_cam * motion;
    place_ = registration.verify(cache, live, T_map_expected);
    if (place_.accepted && apart(T_map_expected, place_.T_map_cam, options_.confirm_m, options_.confirm_rad)) {
      place_.accepted = false;
      place_.reason = "unconfirmed";
    }
    if (!place_.accepted) {
      views_ = 0;
      return false;
    }
  }
  ++views_;
  if (views_ < options_.views || !apart(T_map_first_, place_.T_map_cam, options_.apart_m, options_.apart_rad))
    return false;
  views_ = 0;
  return true;
}

Registration MapSearch::searchAll(const TileCache& cache, MapRegistration& registration, const Pyramid& live,
                                  const FernCode& code, const std::optional<Pose>& T_map_guess) {
  std::vector<Pose> starts = candidates(cache, code);
  if (T_map_guess) starts.insert(starts.begin(), *T_map_guess);
  Registration best;
  best.reason = "no_similar_place";
  std::vector<Registration> judged;
  for (const Pose& T_map_start : starts) judged.push_back(registration.anywhere(cache, live, T_map_start));
  if (judged.empty()) return best;
  best = *std::min_element(judged.begin(), judged.end(), better);
  if (!best.accepted) return best;
  for (const Registration& other : judged)
    if (other.accepted && apart(best.T_map_cam, other.T_map_cam, options_.ambiguous_m, options_.ambiguous_rad)) {
      best.accepted = false;
      best.reason = "ambiguous";
    }
  return best;
}

std::vector<Pose> MapSearch::candidates(const TileCache& cache, const FernCode& code) const {
  std::vector<std::pair<double, const TilePlace*>> similar;
  for (const auto& [key, tile] : cache.tiles())
    for (const TilePlace& place : tile->places) {
      const double d = dissimilarity(place.code, code);
      if (d <= options_.max_dissimilarity) similar.emplace_back(d, &place);
    }
  std::stable_sort(similar.begin(), similar.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Pose> poses;
  for (const auto& [d, place] : similar) {
    if (poses.size() >= options_.candidates) break;
    // Of neighbours one is enough: the alignment's starts reach as far.
    const bool known = std::any_of(poses.begin(), poses.end(),
                                   [&, p = place](const Pose& pose) { return !apart(pose, p->T_map_cam, 0.3, 0.3); });
    if (!known) poses.push_back(place->T_map_cam);
  }
  return poses;
}

}  // namespace comap
