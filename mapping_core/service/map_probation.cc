// The part of MapBuilder that keeps merges in doubt until later keyframes have confirmed or refuted them.
#include <algorithm>

#include "mapping_core/service/map_builder.h"
#include "mapping_core/service/merge_decision.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {

// Takes the testimony of the newest keyframe, if there is one, and undoes what cannot stand.
Result<void> MapBuilder::judgeMerges(const std::optional<KeyframeId>& newest, MapChange& change) {
  const StageSpan span("judge");
  if (newest)
    if (auto heard = watch_.hear(*newest, T_map_cam_); !heard) return heard;
  auto objections = watch_.objections(T_map_cam_);
  if (!objections) return objections.error();
  std::vector<Objection> doomed = std::exchange(doomed_, {});
  doomed.insert(doomed.end(), objections->begin(), objections->end());
  for (const Objection& objection : doomed) {
    const bool gone = std::any_of(change.undone.begin(), change.undone.end(),
                                  [&](const MergeRecord& one) { return one.number == objection.merge; });
    if (gone) continue;
    if (auto undone = undo(objection.merge, objection.reason, change); !undone) return undone;
    recast_due_ = true;
    if (auto noted = store_.setVotesWait(true); !noted) return noted;
  }
  change.confirmed = watch_.takeConfirmed();
  return {};
}

// Puts a merge that stands on probation, with what is known of it: closures between its sides, for and against.
Result<void> MapBuilder::watch(const MergeRecord& merge) {
  const auto edges = store_.edges();
  if (!edges) return edges.error();
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  const auto sides = sidesOf(merge.number, by_index_, *edges, *merges, options_.vote.needed);
  if (!sides) return {};  // its maps are one without it
  std::vector<Closure> voters;
  for (const Edge& edge : *edges)
    if (edge.merge == merge.number) voters.push_back({edge.to, edge.from, edge.T_from_to, edge.information});
  Probation probation(merge.number, mergeSides(sides->first, sides->second), voters);
  for (const Edge& edge : *edges) {
    if (edge.merge == merge.number || (edge.kind != EdgeKind::kLoop && edge.kind != EdgeKind::kInterRobot)) continue;
    const Closure closure{edge.to, edge.from, edge.T_from_to, edge.information};
    if (probation.between(closure)) probation.support(closure);
  }
  for (const Closure& vote : votes_.all()) {
    if (!probation.between(vote)) continue;
    if (fits(vote, T_map_cam_, options_.vote))
      probation.support(vote);
    else
      probation.oppose(vote);
  }
  std::vector<KeyframeId> unheard;
  const auto since = doubtedSince(store_, merge);
  if (!since) return since.error();
  for (size_t i = *since; i < by_index_.size(); ++i) unheard.push_back(by_index_[i]);
  watch_.open(std::move(probation), std::move(unheard));
  return {};
}

// After a restart: every merge whose probation later keyframes have not ended.
Result<void> MapBuilder::watchStanding() {
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  for (const MergeRecord& merge : *merges)
    if (merge.undone.empty())
      if (auto watched = watch(merge); !watched) return watched;
  return {};
}

// Another merge was made or undone: whose side a keyframe is on may be another.
Result<void> MapBuilder::refreshWatch() {
  const std::vector<uint32_t> watched = watch_.merges();
  if (watched.empty()) return {};
  const auto edges = store_.edges();
  if (!edges) return edges.error();
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  for (const uint32_t merge : watched) {
    const auto sides = sidesOf(merge, by_index_, *edges, *merges, options_.vote.needed);
    if (sides)
      watch_.setSides(merge, mergeSides(sides->first, sides->second));
    else
      watch_.close(merge);
  }
  return {};
}

}  // namespace comap
