#include "mapping_core/service/merge_decision.h"

#include <algorithm>
#include <map>

#include "mapping_core/merge/standing.h"
#include "mapping_core/store/keyframe_runs.h"

namespace comap {
namespace {

Error wrongUse(uint32_t merge, const std::string& problem) {
  return {ErrorCode::kWrongUse, "merge " + std::to_string(merge) + " " + problem};
}

Result<MergeRecord> recordOf(const std::vector<MergeRecord>& merges, uint32_t number) {
  const auto found =
      std::find_if(merges.begin(), merges.end(), [&](const MergeRecord& merge) { return merge.number == number; });
  if (found == merges.end())
    return wrongUse(number, "is not in the store, which holds " + std::to_string(merges.size()) +
                                (merges.size() == 1 ? " merge" : " merges"));
  return *found;
}

// Which maps are one: other edges than these do not decide it.
Result<Shape> shapeOf(const MapStore& store, std::span<const KeyframeId> keyframes, size_t votes_needed) {
  const auto edges = store.shapingEdges();
  if (!edges) return edges.error();
  const auto merges = store.merges();
  if (!merges) return merges.error();
  return shapeOf(keyframes, *edges, *merges, votes_needed);
}

// Withdraws for `merge` what ties keyframes of different maps. Returns the anchors of those maps.
Result<std::set<KeyframeId>> withdrawBetween(MapStore& store, std::span<const KeyframeId> keyframes,
                                             const ComponentSet& components, uint32_t merge) {
  const std::vector<KeyframeId> anchors = components.anchors();
  std::map<KeyframeId, uint32_t> number;
  for (const KeyframeId& anchor : anchors) number.emplace(anchor, static_cast<uint32_t>(number.size()));
  KeyframeRuns maps;
  for (const KeyframeId& keyframe : keyframes) maps.add(keyframe, number.at(components.anchorOf(keyframe)));
  const auto withdrawn = store.withdrawEdges(merge, [&](const Edge& edge) {
    const auto from = maps.groupOf(edge.from);
    return !from || maps.groupOf(edge.to) != from;
  });
  if (!withdrawn) return withdrawn.error();
  std::set<KeyframeId> changed;
  for (const auto& [from, to] : *withdrawn)
    for (const KeyframeId& end : {from, to})
      if (const auto map = maps.groupOf(end)) changed.insert(anchors[*map]);
  return changed;
}

}  // namespace

Result<MergeRecord> checkSplit(const MapStore& store, uint32_t number, const std::string& reason) {
  if (reason.empty()) return wrongUse(number, "cannot be undone without a reason");
  const auto merges = store.merges();
  if (!merges) return merges.error();
  auto record = recordOf(*merges, number);
  if (record && !record->undone.empty()) return wrongUse(number, "is undone already: " + record->undone);
  return record;
}

Result<MergeRecord> checkRejoin(const MapStore& store, uint32_t number) {
  const auto merges = store.merges();
  if (!merges) return merges.error();
  auto record = recordOf(*merges, number);
  if (!record) return record;
  if (record->undone.empty()) return wrongUse(number, "is not undone");
  const auto together = store.mergesUndoneBy(number);
  if (!together) return together.error();
  if (together->empty()) return wrongUse(number, "was undone with another merge: " + record->undone);
  return record;
}

Result<MergeDecision> decideSplit(MapStore& store, std::span<const KeyframeId> keyframes, uint32_t number,
                                  const std::string& reason, size_t votes_needed) {
  const auto record = checkSplit(store, number, reason);
  if (!record) return record.error();
  const auto merges = store.merges();
  if (!merges) return merges.error();
  MergeDecision decision;
  const auto note = [&](MergeRecord merge, const std::string& why) -> Result<void> {
    merge.undone = why;
    decision.merges.push_back(std::move(merge));
    return store.undoMerge(decision.merges.back().number, why, number);
  };
  if (auto undone = note(*record, reason); !undone) return undone.error();
  const auto shape = shapeOf(store, keyframes, votes_needed);
  if (!shape) return shape.error();
  for (const uint32_t other : shape->unsupported) {
    const auto lost = recordOf(*merges, other);
    if (!lost) return lost.error();
    const std::string why = "too few of its closures are left without merge " + std::to_string(number);
    if (auto undone = note(*lost, why); !undone) return undone.error();
  }
  auto changed = withdrawBetween(store, keyframes, shape->components, number);
  if (!changed) return changed.error();
  if (changed->empty()) return Error{ErrorCode::kProblem, "merge " + std::to_string(number) + " has no closures"};
  decision.changed = std::move(*changed);
  return decision;
}

Result<MergeDecision> decideRejoin(MapStore& store, std::span<const KeyframeId> keyframes, uint32_t number,
                                   size_t votes_needed) {
  const auto record = checkRejoin(store, number);
  if (!record) return record.error();
  const auto merges = store.merges();
  if (!merges) return merges.error();
  const auto together = store.mergesUndoneBy(number);
  if (!together) return together.error();
  const auto before = shapeOf(store, keyframes, votes_needed);
  if (!before) return before.error();
  const auto closures = store.restoreEdges(number);
  if (!closures) return closures.error();
  for (const Edge& edge : *closures)
    if (before->components.contains(edge.from) && before->components.contains(edge.to) &&
        before->components.together(edge.from, edge.to))
      return wrongUse(number, "cannot be rejoined: its maps were joined by another merge since, undo that first");
  MergeDecision decision;
  for (const uint32_t other : *together) {
    if (auto freed = store.undoMerge(other, "", 0); !freed) return freed.error();
    auto freed = recordOf(*merges, other);
    if (!freed) return freed.error();
    freed->undone.clear();
    // On probation again, with what comes from now on: what was known has been overruled.
    if (auto noted = store.setGivenAgain(other, keyframes.size()); !noted) return noted.error();
    decision.merges.push_back(std::move(*freed));
  }
  const auto shape = shapeOf(store, keyframes, votes_needed);
  if (!shape) return shape.error();
  const auto join =
      std::find_if(shape->joins.begin(), shape->joins.end(), [&](const Join& one) { return one.merge == number; });
  if (join == shape->joins.end()) return wrongUse(number, "cannot be rejoined: too few of its closures are left");
  // What still lies between two maps waits for the merge that keeps them apart.
  uint32_t apart_by = 0;
  for (const MergeRecord& merge : *merges)
    if (!merge.undone.empty() && std::find(together->begin(), together->end(), merge.number) == together->end())
      apart_by = merge.number;
  if (apart_by != 0)
    if (auto again = withdrawBetween(store, keyframes, shape->components, apart_by); !again) return again.error();
  decision.changed = {shape->components.anchorOf(join->closures.front().from)};
  return decision;
}

Result<size_t> doubtedSince(const MapStore& store, const MergeRecord& merge) {
  const auto again = store.givenAgain(merge.number);
  if (!again) return again.error();
  return again->value_or(merge.keyframes_ingested);
}

}  // namespace comap
