// Poses of keyframes from the edges between them, by robust nonlinear least squares (Ceres).
// Edge residual: S log(T_a^-1 T_b Z^-1), S^T S = information: the side Edge's information is given for. Loops by
// graduated non-convexity with truncated least squares.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "mapping_core/graph/edge.h"
#include "protocol/types/result.h"

namespace comap {

struct GraphOptions {
  int max_iterations = 50;
  double sigma_floor_m = 0.002;  ///< no edge is better known than this
  double sigma_floor_rad = 0.0005;
  /// How many times less well loop and inter-robot edges are known than their information says.
  double closure_sigma = 1;
  double gate_chi2 = 16.8;   ///< chi2(6, 0.99): residual beyond which a loop edge counts as false
  bool reject_loops = true;  ///< graduated non-convexity on loop and inter-robot edges
};

struct GraphSolution {
  std::map<KeyframeId, Pose> T_map_cam;
  std::vector<double> edge_weight;  ///< per edge as given: 1 = used fully, 0 = rejected as false
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
};

/// Optimises the poses of one component. `anchor` stays where it is. Values in, values out; no state.
/// kBadData if an edge names a keyframe without initial pose, is not finite or its information is not positive
/// semidefinite; kProblem if the solver fails.
Result<GraphSolution> optimiseGraph(const std::map<KeyframeId, Pose>& initial, std::span<const Edge> edges,
                                    const KeyframeId& anchor, const GraphOptions& options = {});

}  // namespace comap
