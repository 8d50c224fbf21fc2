// The part of MapBuilder that ties keyframes which see the same surface.
#include <algorithm>

#include "mapping_core/service/map_builder.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {

Result<void> MapBuilder::tieLive(const KeyframeId& id) {
  if (options_.live_ties == 0) return {};
  auto members = sketchesOf(components_.anchorOf(id));
  if (!members) return members.error();
  indexTies();
  return tie(id, options_.live_ties, *members);
}

Result<void> MapBuilder::tie(const KeyframeId& id, size_t most, std::span<const PlacedSketch> members) {
  const StageSpan span("tie");
  const auto sketch =
      std::find_if(members.begin(), members.end(), [&](const auto& one) { return one.sketch->id == id; });
  CovisibilityOptions options = options_.covisibility;
  options.per_keyframe = most;
  for (const size_t other : covisibleWith(*sketch, members, options, options_.merge_check.comparison))
    if (auto tied = tieAnew(members[other].sketch->id, id); !tied) return tied;
  return {};
}

void MapBuilder::indexTies() {
  for (; indexed_edges_ < edges_.size(); ++indexed_edges_) {
    const Edge& edge = edges_[indexed_edges_];
    if (edge.kind != EdgeKind::kOdometry && edge.kind != EdgeKind::kCovisibility) continue;
    const bool sorted = edge.from < edge.to;
    ties_[std::minmax(edge.from, edge.to)] = {sorted ? edge.T_from_to : edge.T_from_to.inverse(), indexed_edges_,
                                              edge.kind};
  }
}

Result<void> MapBuilder::tieAnew(const KeyframeId& a, const KeyframeId& b) {
  const auto& [from, to] = std::minmax(a, b);
  const Pose T_from_to = T_map_cam_.at(from).inverse() * T_map_cam_.at(to);
  const auto known = ties_.find({from, to});
  if (known != ties_.end()) {
    if (known->second.kind == EdgeKind::kOdometry) return {};
    const Pose change = known->second.T_from_to.inverse() * T_from_to;
    const bool moved =
        change.translation().norm() > options_.covisibility.moved_m || change.angle() > options_.covisibility.moved_rad;
    if (!moved) return {};
  }
  auto from_view = shelf_.view(from);
  if (!from_view) return from_view.error();
  auto to_view = shelf_.view(to);
  if (!to_view) return to_view.error();
  const auto edge = alignCovisible(**from_view, **to_view, T_from_to, options_.covisibility, tie_workspace_);
  Tie& tie = ties_[{from, to}];
  tie.T_from_to = T_from_to;
  if (!edge) return {};  // an earlier measurement, from where the pair stood then, is kept
  if (tie.edge) {
    edges_[*tie.edge] = *edge;
  } else {
    tie.edge = edges_.size();
    edges_.push_back(*edge);
  }
  if (auto added = addToGraph(*edge); !added) return added;
  return store_.addEdge(*edge);
}

Result<void> MapBuilder::untie() {
  if (auto removed = store_.removeEdges(EdgeKind::kCovisibility); !removed) return removed;
  auto standing = readStanding();
  if (!standing) return standing.error();
  edges_ = std::move(standing->edges);  // in their canonical order
  graphs_.clear();
  ties_.clear();
  indexed_edges_ = 0;
  return {};
}

Result<void> MapBuilder::refine(const std::function<void(size_t, size_t)>& progress) {
  size_t done = 0;
  const size_t all = by_index_.size() * static_cast<size_t>(options_.refine_rounds);
  for (const KeyframeId& anchor : components_.anchors()) {
    for (int round = 0; round < options_.refine_rounds; ++round) {
      auto transaction = store_.begin();
      if (!transaction) return transaction.error();
      indexTies();
      auto members = sketchesOf(anchor);
      if (!members) return members.error();
      std::sort(members->begin(), members->end(),
                [](const auto& a, const auto& b) { return a.sketch->id < b.sketch->id; });
      for (const PlacedSketch& member : *members) {
        const size_t most = options_.covisibility.per_keyframe;
        if (auto tied = tie(member.sketch->id, most, *members); !tied) return tied;
        if (progress) progress(++done, all);
      }
      auto moved = solveWhole(anchor);
      if (!moved) return moved.error();
      if (auto committed = transaction->commit(); !committed) return committed.error();
    }
  }
  return {};
}

}  // namespace comap
