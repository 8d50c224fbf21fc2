// A graph solver for a map whose poses are known already: after a restart, a merge or its undoing.
#pragma once

#include <map>
#include <memory>
#include <span>

#include "mapping_core/graph/graph_solver.h"

namespace comap {

/// The solver of the keyframes in `T_map_cam`, anchored at `anchor`, with those of `edges` that lie between them. Edges
/// that do not fit the poses are rejected, as after solving. Errors as GraphSolver's; kBadData if `anchor` has no pose.
Result<std::unique_ptr<GraphSolver>> settledGraph(const std::map<KeyframeId, Pose>& T_map_cam,
                                                  std::span<const Edge> edges, const KeyframeId& anchor,
                                                  const GraphSolverOptions& options);

}  // namespace comap
