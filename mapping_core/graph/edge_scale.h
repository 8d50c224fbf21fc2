// How well the covariances of a kind of edges fit what is left after solving.
#pragma once

#include <optional>

#include "mapping_core/graph/graph_problem.h"

namespace comap {

/// Median of the used edges' squared residuals over what their number and the graph's stiffness lets expect; 1 if the
/// covariances (scales included) are right. Nullopt if fewer than 30 edges of the kind are checked by others.
std::optional<double> chi2PerFreedom(const GraphProblem& graph, EdgeKind kind);

/// Sets each kind's scale so that this becomes 1, between a quarter and 100. True if one changed by more than a tenth.
bool estimateScales(GraphProblem& graph);

}  // namespace comap
