// Finds the motions of a deformation graph's nodes that bring points together and bend the rest as little as may be.
#pragma once

#include <vector>

#include "mapping_core/paper/deformation_graph.h"

namespace comap {

struct DeformationConstraint {
  TimedPoint source, target;
  /// The target's surface stays where it is too (the side that is not to move).
  bool pin = false;
  /// Both ends may move, but together.
  bool relative = false;
};

struct DeformationSolve {
  double mean_error_m = 0;  ///< distance that sources are left from their targets, pins not counted
  double start_error_m = 0;
  double cost = 0;
  bool solved = false;  ///< false: no nodes, no constraints, or equations that cannot be solved
};

/// Moves the nodes of `graph`; those for which `frozen` is set (may be empty) stay. Steps that raise the cost are taken
/// back. A pure function of its arguments.
DeformationSolve solveDeformation(DeformationGraph& graph, const std::vector<DeformationConstraint>& constraints,
                                  const std::vector<bool>& frozen);

}  // namespace comap
