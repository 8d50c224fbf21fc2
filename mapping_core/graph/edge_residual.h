// What an edge says about two poses. Its information holds for Z = exp(xi) T_from_to, so the increment is recovered
// on that side: xi = log(T_from^-1 T_to Z^-1), and the residual is S xi. (Z^-1 T_from^-1 T_to would need the
// information carried over to the other side by the adjoint of Z.)
#pragma once

#include "protocol/types/pose.h"

namespace comap {

/// Inverse of the left Jacobian of SE3 at `twist` (rho, phi): log(exp(d) exp(twist)) = twist + J^-1 d + O(d^2).
/// |phi| < 2 pi.
Matrix6d inverseLeftJacobian(const Vector6d& twist);

/// inverseLeftJacobian(twist)^T v: what a pull on the increment is to the pose on its left.
Vector6d pulledBack(const Vector6d& twist, const Vector6d& v);

struct EdgeResidual {
  Vector6d increment;  ///< log(T_map_from^-1 T_map_to T_from_to^-1): metres, radians
  Matrix6d d_from;     ///< derivative by d of T_map_from exp(d)
  Matrix6d d_to;       ///< derivative by d of T_map_to exp(d)
};

/// The increment alone.
Vector6d edgeIncrement(const Pose& T_map_from, const Pose& T_map_to, const Pose& T_from_to);
/// The increment with its Jacobians; not whitened.
EdgeResidual edgeResidual(const Pose& T_map_from, const Pose& T_map_to, const Pose& T_from_to);

}  // namespace comap
