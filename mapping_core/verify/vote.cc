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

}  // namespace

std::optional<std::vector<Closure>> VoteBox::cast(const Closure& closure, const Together& together,
                                                  const std::map<KeyframeId, Pose>& T_map_cam) {
  const Pose T_a_query = queryInCandidateMap(closure, T_map_cam);
  const Pose T_b_query = T_map_cam.at(closure.query);
  std::vector<Closure> agreeing{closure};
  for (const Closure& other : pending_) {
    const auto same = oriented(other, closure, together);
    if (!same) continue;
    // Two closures that share a keyframe rest on the same picture: that is no second opinion.
    const bool independent = std::none_of(agreeing.begin(), agreeing.end(), [&](const Closure& one) {
      return one.query == same->query || one.candidate == same->candidate;
    });
    if (!independent) continue;
    const Pose T_a_b_other = queryInCandidateMap(*same, T_map_cam) * T_map_cam.at(same->query).inverse();
    const Pose difference = T_a_query.inverse() * T_a_b_other * T_b_query;
    if (difference.translation().norm() <= options_.agree_m && difference.angle() <= options_.agree_rad)
      agreeing.push_back(*same);
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
