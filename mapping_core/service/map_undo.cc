// Taking a merge back in maps that are at work, and what it shares with the end of a run: maps as a pure function of
// the stored records.
#include <algorithm>

#include "mapping_core/merge/canonical_poses.h"
#include "mapping_core/service/map_builder.h"
#include "mapping_core/service/merge_decision.h"

namespace comap {

Result<Standing> MapBuilder::readStanding() const {
  const auto edges = store_.edges();
  if (!edges) return edges.error();
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  return standingOf(by_index_, *edges, *merges, options_.vote.needed);
}

Result<MapChange> MapBuilder::split(uint32_t number, const std::string& reason) {
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  MapChange change;
  if (auto undone = undo(number, reason, change); !undone) return undone.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

Result<void> MapBuilder::undo(uint32_t number, const std::string& reason, MapChange& change) {
  auto decision = decideSplit(store_, by_index_, number, reason, options_.vote.needed);
  if (!decision) return decision.error();
  change.poses_changed = true;
  change.map = mapIdOf(*decision->changed.begin());
  for (MergeRecord& merge : decision->merges) {
    watch_.close(merge.number);
    change.undone.push_back(std::move(merge));
  }
  auto standing = readStanding();
  if (!standing) return standing.error();
  if (auto reshaped = reshape(std::move(*standing), decision->changed); !reshaped) return reshaped;
  return refreshWatch();
}

Result<MapChange> MapBuilder::rejoin(uint32_t number) {
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  auto decision = decideRejoin(store_, by_index_, number, options_.vote.needed);
  if (!decision) return decision.error();
  MapChange change;
  change.poses_changed = true;
  change.map = mapIdOf(*decision->changed.begin());
  change.merges = std::move(decision->merges);
  auto standing = readStanding();
  if (!standing) return standing.error();
  if (auto reshaped = reshape(std::move(*standing), decision->changed); !reshaped) return reshaped.error();
  if (auto refreshed = refreshWatch(); !refreshed) return refreshed.error();
  for (const MergeRecord& again : change.merges)
    if (auto watched = watch(again); !watched) return watched.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

// Takes over what holds now. Maps anchored at `changed` are laid out anew and their surfels are thrown away.
Result<void> MapBuilder::reshape(Standing standing, const std::set<KeyframeId>& changed) {
  auto poses = canonicalPoses(standing, changed, options_.graph);
  if (!poses) return poses.error();
  std::map<KeyframeId, MapPoses> by_anchor;
  for (const auto& [id, T] : *poses) {
    if (components_.contains(id)) graphs_.erase(components_.anchorOf(id));
    T_map_cam_[id] = T_map_stored_[id] = T;
    by_anchor[standing.components.anchorOf(id)][id] = T;
  }
  if (auto laid_out = surfels_.layOut(by_anchor); !laid_out) return laid_out;
  for (const auto& [anchor, members] : by_anchor)
    if (auto stored = store_.setPoses(mapIdOf(anchor), members); !stored) return stored;
  components_ = std::move(standing.components);
  edges_ = std::move(standing.edges);
  ties_.clear();  // they name places in edges_
  indexed_edges_ = 0;
  return {};
}

Result<void> MapBuilder::settle() {
  const auto standing = readStanding();
  if (!standing) return standing.error();
  const std::vector<KeyframeId> anchors = components_.anchors();
  if (standing->components.anchors() != anchors)
    return Error{ErrorCode::kProblem, "the stored edges and merges give " +
                                          std::to_string(standing->components.anchors().size()) +
                                          " maps, but there are " + std::to_string(anchors.size())};
  auto poses = canonicalPoses(*standing, {anchors.begin(), anchors.end()}, options_.graph);
  if (!poses) return poses.error();
  graphs_.clear();
  for (const auto& [id, T] : *poses) T_map_cam_.at(id) = T;
  return {};
}

}  // namespace comap
