// Poses near their optimum: plain Gauss-Newton steps, a fraction of what Ceres takes for the same.
#pragma once

#include <span>

#include "mapping_core/graph/graph_problem.h"

namespace comap {

/// As GraphProblem::solve(), for a graph that stands near the solution. A step that leads no nearer is undone, and
/// Ceres goes on from there, damped.
Result<int> solveNear(GraphProblem& graph, std::span<const uint32_t> free, const GraphSolveLimits& limits);

}  // namespace comap
