// The part of MapBuilder that asks, before two maps become one, whether a third fits one of them as well.
#include <algorithm>

#include "mapping_core/merge/map_merger.h"
#include "mapping_core/service/map_builder.h"

namespace comap {
namespace {

constexpr size_t kAskedOfOneMap = 3;  // places where one other map may lie, by the newest votes

// Turned so that its candidate is in the map anchored at `anchor`; nothing if neither end is.
std::optional<Closure> seenFrom(const KeyframeId& anchor, const Closure& closure, const ComponentSet& components) {
  if (components.anchorOf(closure.candidate) == anchor) return closure;
  if (components.anchorOf(closure.query) != anchor) return std::nullopt;
  return Closure{closure.candidate, closure.query, closure.T_candidate_query.inverse(), closure.information};
}

}  // namespace

// Where single votes say that other maps lie in the map anchored at `anchor`; of those that agree the newest.
std::vector<MapBuilder::Rival> MapBuilder::alternatives(const KeyframeId& anchor, const KeyframeId& joined) const {
  std::vector<Rival> found;
  const std::vector<Closure>& votes = votes_.all();
  for (auto vote = votes.rbegin(); vote != votes.rend(); ++vote) {
    const auto seen = seenFrom(anchor, *vote, components_);
    if (!seen) continue;
    const KeyframeId other = components_.anchorOf(seen->query);
    if (other == anchor || other == joined) continue;
    const Pose& T_other_query = T_map_cam_.at(seen->query);
    const Pose T_map_other = queryInCandidateMap(*seen, T_map_cam_) * T_other_query.inverse();
    const auto same = [&](const Rival& known) {
      const Pose difference = (known.T_map_other * T_other_query).inverse() * T_map_other * T_other_query;
      return difference.translation().norm() <= options_.vote.agree_m && difference.angle() <= options_.vote.agree_rad;
    };
    size_t asked = 0;
    bool known = false;
    for (const Rival& one : found) {
      if (one.anchor != other) continue;
      ++asked;
      known = known || same(one);
    }
    if (!known && asked < kAskedOfOneMap) found.push_back({other, T_map_other});
  }
  return found;
}

// A third map that fits one of the two to be joined no worse by what is known, and cannot be the same place as the
// other: then one of both joins is wrong, and nothing says yet which.
Result<bool> MapBuilder::hasRival(const std::vector<Closure>& closures) {
  const KeyframeId anchor_a = components_.anchorOf(closures.front().candidate);
  const KeyframeId anchor_b = components_.anchorOf(closures.front().query);
  const Pose T_a_b = averageTransform(closures, T_map_cam_);
  const auto contradict = [&](const std::vector<PlacedSketch>& one, const std::vector<PlacedSketch>& other,
                              const Pose& T_one_other) {
    const Evidence evidence = weighHypothesis(one, other, T_one_other, options_.merge_check);
    return evidence.views >= options_.probation.fewest_views &&
           evidence.contradicted() > options_.merge_check.contradicted;
  };
  for (const bool of_a : {true, false}) {
    const KeyframeId &shared = of_a ? anchor_a : anchor_b, &joined = of_a ? anchor_b : anchor_a;
    const Pose T_joined_shared = of_a ? T_a_b.inverse() : T_a_b;
    const std::vector<Rival> rivals = alternatives(shared, joined);
    if (rivals.empty()) continue;
    const auto shared_views = sketchesOf(shared);
    if (!shared_views) return shared_views.error();
    const auto joined_views = sketchesOf(joined);
    if (!joined_views) return joined_views.error();
    for (const Rival& rival : rivals) {
      const auto views = sketchesOf(rival.anchor);
      if (!views) return views.error();
      const bool exclusive = contradict(*joined_views, *views, T_joined_shared * rival.T_map_other);
      if (exclusive && !contradict(*shared_views, *views, rival.T_map_other)) return true;
    }
  }
  return false;
}

}  // namespace comap
