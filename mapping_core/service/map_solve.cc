// The part of MapBuilder that asks the graph where the keyframes of a map stand, and moves surfels after them.
#include "mapping_core/graph/keyframe_graph.h"
#include "mapping_core/graph/settled_graph.h"
#include "mapping_core/service/map_builder.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
Result<GraphSolver*> MapBuilder::graphOf(const KeyframeId& anchor) {
  const auto known = graphs_.find(anchor);
  if (known != graphs_.end()) return known->second.get();
  GraphSolverOptions options;
  options.graph = options_.graph;
  auto graph = settledGraph(posesOf(anchor), edges_, anchor, options);
  if (!graph) return graph.error();
  return (graphs_[anchor] = std::move(*graph)).get();
}

// To the graph of its map, if that exists; else it will be made with this edge.
Result<void> MapBuilder::addToGraph(const Edge& edge) {
  const auto known = graphs_.find(components_.anchorOf(edge.to));
  return known == graphs_.end() ? Result<void>() : known->second->addEdge(edge);
}

Result<MapBuilder::SolvedMap> MapBuilder::solve(const KeyframeId& anchor) {
  const StageSpan span("optimise");
  auto graph = graphOf(anchor);
  if (!graph) return graph.error();
  auto update = (*graph)->solve();
  if (!update) return update.error();
  std::map<uint32_t, bool> stands;  // merge -> whether the map agrees with one of its closures
  for (const Edge& edge : edges_) {
    if (edge.merge == 0 || !components_.together(edge.from, anchor)) continue;
    const Closure closure{edge.to, edge.from, edge.T_from_to, edge.information};
    stands[edge.merge] |= (*graph)->uses(keyOf(edge)) || fits(closure, update->T_map_cam, options_.vote);
  }
  SolvedMap solved{std::move(update->T_map_cam), {}};
  for (const auto& [merge, agreed] : stands)
    if (!agreed) solved.overruled.push_back(merge);
  return solved;
}

Result<bool> MapBuilder::apply(const KeyframeId& anchor, const MapPoses& T_map_cam) {
  for (const auto& [id, T] : T_map_cam) T_map_cam_.at(id) = T;
  return surfels_.follow(anchor, T_map_cam);
}

// As a whole, from scratch: what a run ends with. The incremental graph begins anew from there.
Result<bool> MapBuilder::solveWhole(const KeyframeId& anchor) {
  graphs_.erase(anchor);
  std::vector<Edge> edges;
  for (const Edge& edge : edges_)
    if (components_.together(edge.from, anchor)) edges.push_back(edge);
  const auto solution = optimiseGraph(posesOf(anchor), edges, anchor, options_.graph);
  if (!solution) return solution.error();
  return apply(anchor, solution->T_map_cam);
}

// What the newest keyframe has changed: itself, its map if that has moved, all maps if some have become one.
Result<void> MapBuilder::storeChanged(const KeyframeId& id, const MapChange& change) {
  const KeyframeId anchor = components_.anchorOf(id);
  if (!change.merges.empty()) {
    for (const KeyframeId& one : components_.anchors())
      if (auto stored = storeMoved(one); !stored) return stored;
    return {};
  }
  if (change.poses_changed) return storeMoved(anchor);
  T_map_stored_[id] = T_map_cam_.at(id);
  return store_.setPoses(mapIdOf(anchor), {{id, T_map_cam_.at(id)}});
}

Result<void> MapBuilder::storeMoved(const KeyframeId& anchor) {
  std::map<KeyframeId, Pose> moved;
  for (const KeyframeId& id : components_.members(anchor)) {
    const Pose& T = T_map_cam_.at(id);
    const auto stored = T_map_stored_.find(id);
    if (stored != T_map_stored_.end() && displacement(T, stored->second) < options_.move_m) continue;
    moved[id] = T_map_stored_[id] = T;
  }
  return store_.setPoses(mapIdOf(anchor), moved);
}

}  // namespace comap
