#include "edge_agent/map_cache/map_filter.h"

#include <Eigen/LU>
#include <algorithm>

namespace comap {
namespace {

constexpr double kDimensions = 6;

Matrix6d diagonal(double translation, double rotation) {
  Vector6d squares;
  squares << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return squares.asDiagonal();
}

}  // namespace

Odometer between(const Odometer& earlier, const Odometer& later) {
  return {later.walked_m - earlier.walked_m, later.turned_rad - earlier.turned_rad,
          later.blind_frames - earlier.blind_frames};
}

Matrix6d MapFilter::drift(const Odometer& since) const {
  const MapFilterOptions& o = options_;
  return since.walked_m * diagonal(o.walk_m, o.walk_rad) + since.turned_rad * diagonal(o.turn_m, o.turn_rad) +
         since.blind_frames * diagonal(o.blind_m, o.blind_rad);
}

void MapFilter::move(const Pose& T_odom_cam, bool blind) {
  const Pose motion = T_odom_cam_.inverse() * T_odom_cam;
  T_odom_cam_ = T_odom_cam;
  const Odometer step{motion.translation().norm(), motion.angle(), blind ? 1 : 0};
  odometer_.walked_m += step.walked_m;
  odometer_.turned_rad += step.turned_rad;
  odometer_.blind_frames += step.blind_frames;
  const Matrix6d ad = motion.inverse().adjoint();
  covariance_ = ad * covariance_ * ad.transpose() + drift(step);
}

void MapFilter::set(const Pose& T_map_odom, const Odometer& since) {
  T_map_odom_ = T_map_odom;
  covariance_ = diagonal(options_.correction_m, options_.correction_rad) + drift(since);
}

bool MapFilter::correct(const Pose& T_map_odom, const Odometer& since) {
  const Matrix6d covariance = diagonal(options_.correction_m, options_.correction_rad) + drift(since);
  if (weigh(T_map_odom * T_odom_cam_, covariance, 1)) return true;
  set(T_map_odom, since);
  return false;
}

bool MapFilter::measure(const Pose& T_map_cam, const Matrix6d& information) {
  Matrix6d covariance = information.inverse();
  if (!covariance.allFinite()) return false;
  covariance += diagonal(options_.registration_m, options_.registration_rad);
  // Of what its error alone explains nothing is taken, of what is far beyond nearly all (James and Stein).
  const Vector6d innovation = (this->T_map_cam().inverse() * T_map_cam).log();
  const double explained = innovation.dot(covariance.partialPivLu().solve(innovation));
  return weigh(T_map_cam, covariance, explained > kDimensions - 2 ? 1 - (kDimensions - 2) / explained : 0.0);
}

bool MapFilter::weigh(const Pose& T_map_cam, const Matrix6d& covariance, double taken) {
  const Vector6d innovation = (this->T_map_cam().inverse() * T_map_cam).log();
  const Eigen::PartialPivLU<Matrix6d> both(covariance_ + covariance);
  if (!(innovation.dot(both.solve(innovation)) <= options_.fits)) return false;
  const Matrix6d gain = both.solve(covariance_).transpose();
  const Pose T_map_cam_weighed = this->T_map_cam() * Pose::exp(taken * (gain * innovation));
  T_map_odom_ = T_map_cam_weighed * T_odom_cam_.inverse();
  covariance_ -= gain * covariance_;
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  for (int i = 0; i < 6; ++i) {
    const double least = i < 3 ? options_.least_m : options_.least_rad;
    covariance_(i, i) = std::max(covariance_(i, i), least * least);
  }
  return true;
}

}  // namespace comap
