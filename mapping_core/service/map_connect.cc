// The part of MapBuilder that decides what an accepted match does: bends its map, votes, joins maps, parts them.
#include <algorithm>
#include <cmath>

#include "mapping_core/merge/map_merger.h"
#include "mapping_core/service/map_builder.h"
#include "mapping_core/service/merge_decision.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

Closure closureOf(const MatchVerdict& verdict) {
  return {verdict.query, verdict.candidate, verdict.T_candidate_query, verdict.information};
}

MatchVerdict verdictOf(const Closure& closure) {
  MatchVerdict verdict;
  verdict.query = closure.query;
  verdict.candidate = closure.candidate;
  verdict.accepted = true;
  verdict.reason = "accepted";
  verdict.T_candidate_query = closure.T_candidate_query;
  verdict.information = closure.information;
  return verdict;
}

Edge edgeOf(const Closure& closure, uint32_t merge) {
  const EdgeKind kind = closure.query.robot == closure.candidate.robot ? EdgeKind::kLoop : EdgeKind::kInterRobot;
  return {closure.candidate, closure.query, kind, closure.T_candidate_query, closure.information, merge};
}

}  // namespace

Result<void> MapBuilder::connect(const MatchVerdict& verdict, MapChange& change) {
  return components_.together(verdict.query, verdict.candidate) ? close(closureOf(verdict), change)
                                                                : propose(verdict, change);
}

// A closure within one map. Between maps whose merge is in doubt it is also a word for it or against it.
Result<void> MapBuilder::close(const Closure& closure, MapChange& change) {
  const KeyframeId anchor = components_.anchorOf(closure.query);
  const Edge edge = edgeOf(closure, 0);
  const auto graph = graphOf(anchor);
  if (!graph) return graph.error();
  if (auto added = (*graph)->addEdge(edge); !added) return added;
  auto solved = solve(anchor);
  if (!solved) return solved.error();
  doomOverruled(*solved);
  bool holds = true;
  if (watch_.inDoubt(closure.query, closure.candidate)) {
    holds = fits(closure, solved->T_map_cam, options_.vote) && solved->overruled.empty();
    watch_.weigh(closure, holds);
  }
  if (holds) {
    edges_.push_back(edge);
    if (auto stored = store_.addEdge(edge); !stored) return stored;
  } else {
    // Not an edge, which would go with the merge: if that comes apart, it is a vote for what is right.
    (*graph)->removeEdge(keyOf(edge));
    votes_.keep(closure);
    solved = solve(anchor);
    if (!solved) return solved.error();
  }
  const auto moved = apply(anchor, solved->T_map_cam);
  if (!moved) return moved.error();
  change.poses_changed = change.poses_changed || *moved;
  return {};
}

void MapBuilder::doomOverruled(const SolvedMap& solved) {
  for (const uint32_t merge : solved.overruled)
    doomed_.push_back({merge, "the graph rejects all closures that made it"});
}

// A closure between two maps: a vote, and perhaps the last that was needed.
Result<void> MapBuilder::propose(const MatchVerdict& verdict, MapChange& change) {
  const Together together = [this](const auto& a, const auto& b) { return components_.together(a, b); };
  const auto agreed = votes_.cast(closureOf(verdict), together, T_map_cam_);
  if (!agreed) return {};
  std::optional<StageSpan> weighing(std::in_place, "weigh");
  const auto contradicted = weighMerge(*agreed);
  if (!contradicted) return contradicted.error();
  if (*contradicted > 0) {
    // Its voters are spent: only new views of the two maps can bring the question up again.
    for (const Closure& voter : *agreed) {
      const bool last = voter.query == verdict.query && voter.candidate == verdict.candidate;
      MatchVerdict refusal = last ? verdict : verdictOf(voter);
      refusal.accepted = false;
      refusal.reason = "contradiction";
      refusal.seen_through = *contradicted;
      change.verdicts.push_back(refusal);
      if (auto stored = store_.addVerdict(refusal); !stored) return stored;
    }
    return {};
  }
  const auto rival = hasRival(*agreed);
  if (!rival) return rival.error();
  if (*rival) {
    // Its voters wait: more views of these maps will refute one of the two.
    for (const Closure& voter : *agreed) votes_.keep(voter);
    MatchVerdict refusal = verdict;
    refusal.accepted = false;
    refusal.reason = "rival";
    change.verdicts.push_back(refusal);
    return store_.addVerdict(refusal);
  }
  weighing.reset();
  const StageSpan joining("join");
  auto record = merge(*agreed);
  if (!record) return record.error();
  change.merges.push_back(*record);
  change.poses_changed = true;
  const KeyframeId anchor = components_.anchorOf(verdict.query);
  const auto solved = solve(anchor);
  if (!solved) return solved.error();
  if (auto moved = apply(anchor, solved->T_map_cam); !moved) return moved.error();
  if (auto refreshed = refreshWatch(); !refreshed) return refreshed;
  return watch(*record);
}

// The share of common surface that contradicts a merge, if that is too much; else 0.
Result<double> MapBuilder::weighMerge(const std::vector<Closure>& closures) {
  const KeyframeId anchor_a = components_.anchorOf(closures.front().candidate);
  const KeyframeId anchor_b = components_.anchorOf(closures.front().query);
  const Pose T_a_b = averageTransform(closures, T_map_cam_);
  const auto a = sketchesOf(anchor_a);
  if (!a) return a.error();
  const auto b = sketchesOf(anchor_b);
  if (!b) return b.error();
  const Evidence all = weighHypothesis(*a, *b, T_a_b, options_.merge_check);
  if (all.contradicted() > options_.merge_check.contradicted) return all.contradicted();

  // What parted these maps before must not drown among what looked alike.
  const auto parted = partedBetween(anchor_a, anchor_b);
  if (!parted) return parted.error();
  for (const uint32_t since : *parted) {
    const auto later = [&](const PlacedSketch& one) { return index_.at(one.sketch->id) >= since; };
    std::vector<PlacedSketch> new_a, old_a, new_b;
    for (const PlacedSketch& one : *a) (later(one) ? new_a : old_a).push_back(one);
    std::copy_if(b->begin(), b->end(), std::back_inserter(new_b), later);
    Evidence recent = weighHypothesis(new_a, *b, T_a_b, options_.merge_check);
    recent.add(weighHypothesis(old_a, new_b, T_a_b, options_.merge_check));
    if (recent.views >= options_.probation.fewest_views && recent.contradicted() > options_.probation.contradicted)
      return recent.contradicted();
  }
  return 0.0;
}

// Merges of these two maps that were undone: how many keyframes there were when each was made.
Result<std::vector<uint32_t>> MapBuilder::partedBetween(const KeyframeId& a, const KeyframeId& b) const {
  const auto merges = store_.merges();
  if (!merges) return merges.error();
  const auto withdrawn = store_.withdrawnEdges();
  if (!withdrawn) return withdrawn.error();
  std::vector<uint32_t> since;
  for (const MergeRecord& merge : *merges) {
    if (merge.undone.empty()) continue;
    const bool between = std::any_of(withdrawn->begin(), withdrawn->end(), [&](const WithdrawnEdge& one) {
      if (one.edge.merge != merge.number || !components_.contains(one.edge.from) || !components_.contains(one.edge.to))
        return false;
      const KeyframeId from = components_.anchorOf(one.edge.from), to = components_.anchorOf(one.edge.to);
      return (from == a && to == b) || (from == b && to == a);
    });
    if (!between) continue;
    const auto made = doubtedSince(store_, merge);
    if (!made) return made.error();
    since.push_back(static_cast<uint32_t>(*made));
  }
  return since;
}

Result<std::vector<PlacedSketch>> MapBuilder::sketchesOf(const KeyframeId& anchor) {
  std::vector<PlacedSketch> placed;
  for (const KeyframeId& id : components_.members(anchor)) {
    const auto sketch = shelf_.sketch(id);
    if (!sketch) return sketch.error();
    placed.push_back({*sketch, T_map_cam_.at(id)});
  }
  return placed;
}

Result<MergeRecord> MapBuilder::merge(const std::vector<Closure>& closures) {
  const KeyframeId a = components_.anchorOf(closures.front().candidate);
  const KeyframeId b = components_.anchorOf(closures.front().query);
  const Pose T_a_b = averageTransform(closures, T_map_cam_);
  const std::vector<KeyframeId> members_a = components_.members(a), members_b = components_.members(b);
  const KeyframeId kept = components_.join(a, b)->first;
  const bool keeps_a = kept == a;
  const KeyframeId absorbed = keeps_a ? b : a;
  const Pose T_kept_absorbed = keeps_a ? T_a_b : T_a_b.inverse();

  if (auto joined = surfels_.join(kept, absorbed, T_kept_absorbed); !joined) return joined.error();
  for (const KeyframeId& id : keeps_a ? members_b : members_a) {
    T_map_cam_.at(id) = T_kept_absorbed * T_map_cam_.at(id);
    T_map_stored_.erase(id);  // the name of its map is another, too
  }

  MergeRecord record;
  record.number = ++merges_;
  record.kept = mapIdOf(kept);
  record.absorbed = mapIdOf(absorbed);
  record.T_kept_absorbed = T_kept_absorbed;
  record.robots = components_.robots(kept);
  record.keyframes_ingested = static_cast<uint32_t>(by_index_.size());
  graphs_.erase(a);
  graphs_.erase(b);
  const auto graph = graphOf(kept);  // of both, before the closures pull
  if (!graph) return graph.error();
  for (const Closure& closure : closures) {
    record.voters.push_back(closure.query);
    edges_.push_back(edgeOf(closure, record.number));
    if (auto added = (*graph)->addEdge(edges_.back()); !added) return added.error();
    if (auto stored = store_.addEdge(edges_.back()); !stored) return stored.error();
  }
  if (auto stored = store_.addMerge(record); !stored) return stored.error();
  return record;
}

Result<void> MapBuilder::castAll(MapChange& change) {
  for (const Closure& closure : votes_.takeAll())
    if (auto connected = connect(verdictOf(closure), change); !connected) return connected;
  return store_.setVotesWait(false);
}

Result<MapChange> MapBuilder::recast() {
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  MapChange change;
  if (auto cast = castAll(change); !cast) return cast.error();
  if (auto stored = storePoses(); !stored) return stored.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  recast_due_ = false;
  return change;
}

}  // namespace comap
