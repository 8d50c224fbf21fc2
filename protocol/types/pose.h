// Rigid motion SE(3). T_a_b maps points of frame b into frame a: x_a = R x_b + t.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace comap {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The skew matrix [v]x with [v]x w = v x w.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

class Pose {
 public:
  Pose() = default;
  Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : Pose(Eigen::Quaterniond(rotation), translation) {}

  /// exp of a twist (rho, phi): metres and radians; translation first, as in every 6-vector here.
  static Pose exp(const Vector6d& twist);
  /// Inverse of exp; |phi| <= pi.
  Vector6d log() const;

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotationMatrix() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  Pose inverse() const;
  /// Adjoint Ad with exp(Ad xi) T = T exp(xi).
  Matrix6d adjoint() const;
  /// Rotation angle in radians, 0..pi.
  double angle() const;
  bool isFinite() const;

  friend Pose operator*(const Pose& a, const Pose& b) {
    return Pose(a.rotation_ * b.rotation_, a.rotation_ * b.translation_ + a.translation_);
  }
  friend Eigen::Vector3d operator*(const Pose& a, const Eigen::Vector3d& x) {
    return a.rotation_ * x + a.translation_;
  }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

/// Between a (s = 0) and b (s = 1): translation linear, rotation slerp.
Pose interpolate(const Pose& a, const Pose& b, double s);

}  // namespace comap
