// Whether a closure can be true at all, given the rest of the graph: judged along one path, before any solving.
#pragma once

#include <optional>

#include "mapping_core/graph/graph_problem.h"

namespace comap {

enum class PathOver { kUsedEdges, kOdometry };

/// Squared residual of an edge against the best-known path of other used edges (or of odometry alone) between its ends,
/// in units of the covariance of path and edge together. Other paths can only make the true residual larger, so a large
/// value refutes the edge; a small one proves nothing. Nullopt if no path joins the ends or the path leaves a direction
/// open.
std::optional<double> pathChi2(const GraphProblem& graph, uint32_t edge, PathOver over = PathOver::kUsedEdges);

}  // namespace comap
