#include "mapping_core/verify/vote.h"

#include <algorithm>

namespace comap {
namespace {

// Turned so that its query is in the same map as `like`'s query; nothing if it joins other maps.
std::optional<Closure> oriented(const Closure& closure, const Closure& like, const Together& together) {
  if (together(closure.query, like.query) && together(closure.candidate, like.candidate)) return closure;
  if (together(closure.candidate, like.query) && together(closure.query, like.candidate)) {
    const Pose inverse = closure.T_candidate_query.inverse();
    const Matrix6d ad = closure.T_candidate_query.adjoint();
    return Closure{closure.candidate, closure.query, inverse, ad.transpose() * closure.information * ad};
  }
  return std::nullopt;
}

// As `like` has its maps. Measured where `like`'s query stands, not at the far origin.
bool sameTransform(const Closure& same, const Closure& like, const std::map<KeyframeId, Pose>& T_map_cam,
                   const VoteOptions& options) {
  const Pose T_a_b = queryInCandidateMap(same, T_map_cam) * T_map_cam.at(same.query).inverse();
  const Pose difference = queryInCandidateMap(like, T_map_cam).inverse() * T_a_b * T_map_cam.at(like.query);
  return difference.translation().norm() <= options.agree_m && difference.angle() <= options.agree_rad;
}

}  // namespace

bool agree(const Closure& a, const Closure& b, const Together& together, const std::map<KeyframeId, Pose>& T_map_cam,
           const VoteOptions& options) {
  const auto same = oriented(b, a, together);
  return same && sameTransform(*same, a, T_map_cam, options);
}

bool fits(const Closure& closure, const std::map<KeyframeId, Pose>& T_map_cam, const VoteOptions& options) {
  const Pose difference = queryInCandidateMap(closure, T_map_cam).inverse() * T_map_cam.at(closure.query);
  return difference.translation().norm() <= options.agree_m && difference.angle() <= options.agree_rad;
}

bool independent(const Closure& a, const Closure& b) {
  return a.query != b.query && a.candidate != b.candidate && a.query != b.candidate && a.candidate != b.query;
}

std::optional<std::vector<Closure>> VoteBox::cast(const Closure& closure, const Together& together,
                                                  const std::map<KeyframeId, Pose>& T_map_cam) {
  std::vector<Closure> agreeing{closure};
  for (const Closure& other : pending_) {
    const auto same = oriented(other, closure, together);
    if (!same) continue;
    // Two closures that share a keyframe rest on the same picture: that is no second opinion.
    const bool second =
        std::all_of(agreeing.begin(), agreeing.end(), [&](const Closure& one) { return independent(one, *same); });
    if (second && sameTransform(*same, closure, T_map_cam, options_)) agreeing.push_back(*same);
  }
  if (agreeing.size() < options_.needed) {
    pending_.push_back(closure);
    return std::nullopt;
  }
  std::erase_if(pending_, [&](const Closure& other) {
    const auto same = oriented(other, closure, together);
    return same && std::any_of(agreeing.begin(), agreeing.end(), [&](const Closure& one) {
             return one.query == same->query && one.candidate == same->candidate;
           });
  });
  return agreeing;
}

}  // namespace comap
