// How far an edge is trusted: its information matrix, limited and brought into the form the solver uses.
#pragma once

#include "mapping_core/graph/edge.h"
#include "mapping_core/graph/keyframe_graph.h"
#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap {

/// The matrix S with S^T S = (information^-1 + floor)^-1, so that |S xi|^2 is the chi2 of an increment xi = (rho, phi).
/// The floor is diagonal: sigma_floor_m (metres) and sigma_floor_rad (radians); directions of no information stay so.
/// kBadData if `information` is not finite, not symmetric or not positive semidefinite (to 1e-6 of its scale).
Result<Matrix6d> squareRootInformation(const Matrix6d& information, double sigma_floor_m, double sigma_floor_rad);

/// The same for an edge, as the options have its kind.
Result<Matrix6d> squareRootInformation(const Edge& edge, const GraphOptions& options);

}  // namespace comap
