// Taking a merge back, and what it shares with the end of a run: maps as a pure function of the stored records.
#include <algorithm>

#include "mapping_core/merge/canonical_poses.h"
#include "mapping_core/service/map_builder.h"

namespace comap {
namespace {

Error wrongUse(uint32_t merge, const std::string& problem) {
  return {ErrorCode::kWrongUse, "merge " + std::to_string(merge) + " " + problem};
}

Result<MergeRecord> recordOf(const std::vector<MergeRecord>& merges, uint32_t number) {
  const auto found =
      std::find_if(merges.begin(), merges.end(), [&](const MergeRecord& merge) { return merge.number == number; });
  if (found == merges.end())
    return wrongUse(number, "is not in the store, which holds " + std::to_string(merges.size()) + " merges");
  return *found;
}

}  // namespace

Result<Standing> MapBuilder::readStanding() const {
  const auto edges = store_.edges();
  if (!edges) return edges.error();
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  return standingOf(by_index_, *edges, *merges, options_.vote.needed);
}

Result<MapChange> MapBuilder::split(uint32_t number, const std::string& reason) {
  if (reason.empty()) return wrongUse(number, "cannot be undone without a reason");
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  MapChange change;
  if (auto undone = undo(number, reason, change); !undone) return undone.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

Result<void> MapBuilder::undo(uint32_t number, const std::string& reason, MapChange& change) {
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  auto record = recordOf(*merges, number);
  if (!record) return record.error();
  if (!record->undone.empty()) return wrongUse(number, "is undone already: " + record->undone);

  change.poses_changed = true;
  const auto note = [&](MergeRecord merge, const std::string& why) -> Result<void> {
    merge.undone = why;
    watch_.close(merge.number);
    change.undone.push_back(std::move(merge));
    return store_.undoMerge(change.undone.back().number, why, number);
  };
  if (auto undone = note(*record, reason); !undone) return undone.error();
  auto standing = readStanding();
  if (!standing) return standing.error();
  for (const uint32_t other : standing->unsupported) {
    const auto lost = recordOf(*merges, other);
    if (!lost) return lost.error();
    const std::string why = "too few of its closures are left without merge " + std::to_string(number);
    if (auto undone = note(*lost, why); !undone) return undone.error();
  }
  std::set<KeyframeId> changed;
  for (const Edge& edge : standing->apart) {
    if (auto withdrawn = store_.withdrawEdge(edge, number); !withdrawn) return withdrawn.error();
    for (const KeyframeId& end : {edge.from, edge.to})
      if (standing->components.contains(end)) changed.insert(standing->components.anchorOf(end));
  }
  if (changed.empty()) return Error{ErrorCode::kProblem, "merge " + std::to_string(number) + " has no closures"};
  change.map = mapIdOf(*changed.begin());
  if (auto reshaped = reshape(std::move(*standing), changed); !reshaped) return reshaped;
  return refreshWatch();
}

Result<MapChange> MapBuilder::rejoin(uint32_t number) {
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  auto record = recordOf(*merges, number);
  if (!record) return record.error();
  if (record->undone.empty()) return wrongUse(number, "is not undone");
  const auto together = store_.mergesUndoneBy(number);
  if (!together) return together.error();
  if (together->empty()) return wrongUse(number, "was undone with another merge: " + record->undone);
  const auto withdrawn = store_.withdrawnEdges();
  if (!withdrawn) return withdrawn.error();

  MapChange change;
  change.poses_changed = true;
  for (const WithdrawnEdge& one : *withdrawn) {
    if (one.withdrawn_by != number) continue;
    const Edge& edge = one.edge;
    const bool ends_known = components_.contains(edge.from) && components_.contains(edge.to);
    if (edge.merge == number && ends_known && components_.together(edge.from, edge.to))
      return wrongUse(number, "cannot be rejoined: its maps were joined by another merge since, undo that first");
    if (auto freed = store_.withdrawEdge(edge, 0); !freed) return freed.error();
  }
  for (const uint32_t other : *together) {
    if (auto freed = store_.undoMerge(other, "", 0); !freed) return freed.error();
    auto freed = recordOf(*merges, other);
    if (!freed) return freed.error();
    freed->undone.clear();
    change.merges.push_back(std::move(*freed));
  }
  auto standing = readStanding();
  if (!standing) return standing.error();
  const auto join = std::find_if(standing->joins.begin(), standing->joins.end(),
                                 [&](const Join& one) { return one.merge == number; });
  if (join == standing->joins.end()) return wrongUse(number, "cannot be rejoined: too few of its closures are left");
  // What still lies between two maps waits for the merge that keeps them apart.
  uint32_t apart_by = 0;
  for (const MergeRecord& merge : *merges)
    if (!merge.undone.empty() && std::find(together->begin(), together->end(), merge.number) == together->end())
      apart_by = merge.number;
  if (apart_by != 0)
    for (const Edge& edge : standing->apart)
      if (auto again = store_.withdrawEdge(edge, apart_by); !again) return again.error();

  const KeyframeId anchor = standing->components.anchorOf(join->closures.front().from);
  change.map = mapIdOf(anchor);
  if (auto reshaped = reshape(std::move(*standing), {anchor}); !reshaped) return reshaped.error();
  if (auto refreshed = refreshWatch(); !refreshed) return refreshed.error();
  // On probation again, with what comes from now on: what was known has been overruled.
  for (MergeRecord& again : change.merges) {
    again.keyframes_ingested = static_cast<uint32_t>(by_index_.size());
    if (auto stored = store_.addMerge(again); !stored) return stored.error();
    if (auto watched = watch(again); !watched) return watched.error();
  }
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
