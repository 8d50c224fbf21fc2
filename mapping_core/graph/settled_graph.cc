#include "mapping_core/graph/settled_graph.h"

namespace comap {

Result<std::unique_ptr<GraphSolver>> settledGraph(const std::map<KeyframeId, Pose>& T_map_cam,
                                                  std::span<const Edge> edges, const KeyframeId& anchor,
                                                  const GraphSolverOptions& options) {
  if (!T_map_cam.contains(anchor))
    return Error{ErrorCode::kBadData, "anchor " + toString(anchor) + " has no initial pose"};
  auto graph = std::make_unique<GraphSolver>(options);
  std::map<KeyframeId, KeyframeId> before;
  for (const Edge& edge : edges)
    if (edge.kind == EdgeKind::kOdometry) before[edge.to] = edge.from;
  if (auto added = graph->addKeyframe(anchor, T_map_cam.at(anchor)); !added) return added.error();
  for (const auto& [id, T] : T_map_cam) {
    if (id == anchor) continue;
    const auto previous = before.find(id);
    const auto hangs_on = previous == before.end() ? std::nullopt : std::optional(previous->second);
    if (auto added = graph->addKeyframe(id, T, hangs_on); !added) return added.error();
  }
  for (const Edge& edge : edges) {
    if (!T_map_cam.contains(edge.from) || !T_map_cam.contains(edge.to)) continue;
    if (auto added = graph->addSettled(edge); !added) return added.error();
  }
  return graph;
}

}  // namespace comap
