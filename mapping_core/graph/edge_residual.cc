#include "mapping_core/graph/edge_residual.h"

#include <cmath>

namespace comap {
namespace {

constexpr double kSmallAngle = 0.02;

Eigen::Matrix3d inverseLeftJacobianSo3(const Eigen::Vector3d& phi) {
  const double theta = phi.norm();
  const double t2 = theta * theta;
  const double c = theta < kSmallAngle ? 1.0 / 12 + t2 / 720 + t2 * t2 / 30240
                                       : (1 - theta * std::sin(theta) / (2 * (1 - std::cos(theta)))) / t2;
  const Eigen::Matrix3d k = skew(phi);
  return Eigen::Matrix3d::Identity() - 0.5 * k + c * k * k;
}

// The block of SE3's left Jacobian that couples rotation into translation.
Eigen::Matrix3d couplingBlock(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi) {
  const double t = phi.norm();
  const double t2 = t * t;
  double a = 1.0 / 6 - t2 / 120, b = 1.0 / 24 - t2 / 720, c = 1.0 / 120 - t2 / 2520;
  if (t > kSmallAngle) {  // below, the closed forms cancel and the two terms above are exact to 1e-11
    const double sin_t = std::sin(t), cos_t = std::cos(t);
    a = (t - sin_t) / (t2 * t);
    b = (t2 + 2 * cos_t - 2) / (2 * t2 * t2);
    c = (2 * t - 3 * sin_t + t * cos_t) / (2 * t2 * t2 * t);
  }
  const Eigen::Matrix3d p = skew(phi), r = skew(rho);
  const Eigen::Matrix3d pr = p * r, rp = r * p, prp = pr * p;
  return 0.5 * r + a * (pr + rp + prp) + b * (p * pr + rp * p - 3 * prp) + c * (prp * p + p * prp);
}

}  // namespace

Matrix6d inverseLeftJacobian(const Vector6d& twist) {
  const Eigen::Vector3d rho = twist.head<3>(), phi = twist.tail<3>();
  const Eigen::Matrix3d inverse = inverseLeftJacobianSo3(phi);
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>() = inverse;
  j.bottomRightCorner<3, 3>() = inverse;
  j.topRightCorner<3, 3>() = -inverse * couplingBlock(rho, phi) * inverse;
  return j;
}

Vector6d pulledBack(const Vector6d& twist, const Vector6d& v) {
  const Eigen::Vector3d rho = twist.head<3>(), phi = twist.tail<3>();
  if (phi.squaredNorm() > kSmallAngle * kSmallAngle) return inverseLeftJacobian(twist).transpose() * v;
  // The series 1 - ad / 2 + ad^2 / 12, whose next term is of the fourth power.
  const auto bracket = [&](const Vector6d& x) {
    Vector6d result;
    result << x.head<3>().cross(phi), x.head<3>().cross(rho) + x.tail<3>().cross(phi);
    return result;
  };
  const Vector6d once = bracket(v);
  return v - 0.5 * once + bracket(once) / 12;
}

Vector6d edgeIncrement(const Pose& T_map_from, const Pose& T_map_to, const Pose& T_from_to) {
  return (T_map_from.inverse() * T_map_to * T_from_to.inverse()).log();
}

EdgeResidual edgeResidual(const Pose& T_map_from, const Pose& T_map_to, const Pose& T_from_to) {
  EdgeResidual result;
  result.increment = edgeIncrement(T_map_from, T_map_to, T_from_to);
  result.d_from = -inverseLeftJacobian(result.increment);
  result.d_to = inverseLeftJacobian(-result.increment) * T_from_to.adjoint();
  return result;
}

}  // namespace comap
