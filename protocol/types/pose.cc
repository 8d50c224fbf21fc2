#include "protocol/types/pose.h"

#include <algorithm>
#include <cmath>

namespace comap {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Pose Pose::exp(const Vector6d& twist) {
  const Eigen::Vector3d rho = twist.head<3>();
  const Eigen::Vector3d phi = twist.tail<3>();
  const double theta = phi.norm();
  const Eigen::Matrix3d k = skew(phi);
  // Series below 1e-4 rad: the closed forms cancel there.
  const double a = theta < 1e-4 ? 0.5 - theta * theta / 24 : (1 - std::cos(theta)) / (theta * theta);
  const double b = theta < 1e-4 ? 1.0 / 6 - theta * theta / 120 : (theta - std::sin(theta)) / (theta * theta * theta);
  const Eigen::Matrix3d v = Eigen::Matrix3d::Identity() + a * k + b * k * k;
  const double half = theta / 2;
  const double s = theta < 1e-8 ? 0.5 : std::sin(half) / theta;
  return Pose(Eigen::Quaterniond(std::cos(half), s * phi.x(), s * phi.y(), s * phi.z()), v * rho);
}

Vector6d Pose::log() const {
  Eigen::Quaterniond q = rotation_;
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double n = q.vec().norm();
  const double theta = 2 * std::atan2(n, q.w());
  const Eigen::Vector3d phi = n < 1e-10 ? Eigen::Vector3d(2 * q.vec()) : Eigen::Vector3d(q.vec() * (theta / n));
  const Eigen::Matrix3d k = skew(phi);
  // theta sin(theta) / (2 (1 - cos(theta))), without the cancellation of 1 - cos.
  const double half = theta / 2;
  const double c = theta < 1e-4 ? 1.0 / 12 + theta * theta / 720 : (1 - half / std::tan(half)) / (theta * theta);
  Vector6d twist;
  twist << (Eigen::Matrix3d::Identity() - 0.5 * k + c * k * k) * translation_, phi;
  return twist;
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotationMatrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation_.conjugate();
  return Pose(inverse_rotation, -(inverse_rotation * translation_));
}

Matrix6d Pose::adjoint() const {
  const Eigen::Matrix3d r = rotationMatrix();
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = r;
  ad.topRightCorner<3, 3>() = skew(translation_) * r;
  ad.bottomRightCorner<3, 3>() = r;
  return ad;
}

double Pose::angle() const { return 2 * std::atan2(rotation_.vec().norm(), std::abs(rotation_.w())); }

bool Pose::isFinite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

Pose interpolate(const Pose& a, const Pose& b, double s) {
  return Pose(a.rotation().slerp(s, b.rotation()), (1 - s) * a.translation() + s * b.translation());
}

}  // namespace comap
