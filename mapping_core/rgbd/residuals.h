// The two residuals of RGB-D alignment and their exact Jacobians for the left increment
// T_ref_cur <- exp(xi) T_ref_cur, xi = (rho, phi), one point at a time. Checked against numeric ones; the solver's
// vectorised loop (point_residuals) is checked against these.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace comap {

template <class Scalar>
using Row6 = Eigen::Matrix<Scalar, 1, 6>;
template <class Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

/// Point to plane: r = n . (x - d); x = T_ref_cur x_cur, plane (d, n) in the reference camera's frame.
template <class Scalar>
Row6<Scalar> geometricJacobian(const Vector3<Scalar>& x_ref, const Vector3<Scalar>& normal) {
  Row6<Scalar> row;
  row << normal.transpose(), x_ref.cross(normal).transpose();
  return row;
}

/// Photometric: r = I_cur(pi(T_cur_ref p)) - I_ref. `gradient` of I_cur at the warped pixel (grey levels a pixel),
/// x_cur = T_cur_ref p. The minus comes from perturbing the inverse.
template <class Scalar>
Row6<Scalar> photometricJacobian(const Vector3<Scalar>& p_ref, const Vector3<Scalar>& x_cur,
                                 const Eigen::Matrix<Scalar, 3, 3>& R_ref_cur, Scalar gx, Scalar gy, Scalar fx,
                                 Scalar fy) {
  const Scalar iz = 1 / x_cur.z();
  const Vector3<Scalar> h(gx * fx * iz, gy * fy * iz, -(gx * fx * x_cur.x() + gy * fy * x_cur.y()) * iz * iz);
  const Vector3<Scalar> a = -(R_ref_cur * h);
  Row6<Scalar> row;
  row << a.transpose(), p_ref.cross(a).transpose();
  return row;
}

}  // namespace comap
