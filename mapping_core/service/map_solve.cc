// The part of MapBuilder that asks the graph where the keyframes of a map stand, and moves surfels after them.
#include <algorithm>
#include <cmath>

#include "mapping_core/service/map_builder.h"

namespace comap {
namespace {

// How far a pose change carries what its camera sees, 2 m away.
double displacement(const Pose& T_new, const Pose& T_old) {
  const Pose change = T_new * T_old.inverse();
  const Eigen::Vector3d seen = T_old * Eigen::Vector3d(0, 0, 2);
  return std::max((change * T_old.translation() - T_old.translation()).norm(), (change * seen - seen).norm());
}

}  // namespace

Result<MapBuilder::SolvedMap> MapBuilder::solve(const KeyframeId& anchor) const {
  std::vector<Edge> edges;
  for (const Edge& edge : edges_)
    if (components_.together(edge.from, anchor)) edges.push_back(edge);
  auto solution = optimiseGraph(posesOf(anchor), edges, anchor, options_.graph);
  if (!solution) return solution.error();
  std::map<uint32_t, bool> stands;  // merge -> whether the map agrees with one of its closures
  for (size_t i = 0; i < edges.size(); ++i) {
    const Edge& edge = edges[i];
    if (edge.merge == 0) continue;
    const Closure closure{edge.to, edge.from, edge.T_from_to, edge.information};
    stands[edge.merge] |= solution->edge_weight[i] > 0 || fits(closure, solution->T_map_cam, options_.vote);
  }
  SolvedMap solved{std::move(solution->T_map_cam), {}};
  for (const auto& [merge, agreed] : stands)
    if (!agreed) solved.overruled.push_back(merge);
  return solved;
}

Result<bool> MapBuilder::apply(const KeyframeId& anchor, const std::map<KeyframeId, Pose>& T_map_cam) {
  double largest = 0;
  for (const auto& [id, T] : T_map_cam) {
    T_map_cam_.at(id) = T;
    largest = std::max(largest, displacement(T, T_map_fused_.at(id)));
  }
  if (largest > 0) stale_.insert(anchor);
  if (largest < options_.move_m) return false;
  std::vector<Pose> T_new_old(by_index_.size());
  for (const auto& [id, T] : T_map_cam) {
    T_new_old[entries_.at(id).index] = T * T_map_fused_.at(id).inverse();
    T_map_fused_.at(id) = T;
  }
  if (auto moved = maps_.at(anchor).moveOwners(T_new_old); !moved) return moved.error();
  return true;
}

Result<bool> MapBuilder::optimise(const KeyframeId& anchor) {
  const auto solved = solve(anchor);
  if (!solved) return solved.error();
  doomOverruled(*solved);
  return apply(anchor, solved->T_map_cam);
}

}  // namespace comap
