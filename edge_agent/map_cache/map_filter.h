// Where the robot's odometry frame stands in the map, weighed from what the core says and from registrations. A Kalman
// filter over the camera's pose: what is known of it fades as the odometry drifts.
#pragma once

#include "protocol/types/pose.h"

namespace comap {

struct MapFilterOptions {
  /// One sigma after a metre walked or a radian turned; grows with the root of the way, as a drift does.
  double walk_m = 0.010, walk_rad = 0.006;
  double turn_m = 0.010, turn_rad = 0.006;
  double blind_m = 0.02, blind_rad = 0.02;  ///< and after a frame whose pose is a prediction
  /// A registration is not better known than this however small its residuals, along an axis: tiles are rounded, and
  /// the map has its own errors. Views of the same surfaces are wrong by the same, which no number of them takes away:
  /// what a registration may be wrong by moves nothing.
  double registration_m = 0.0012, registration_rad = 0.0006;
  double correction_m = 0.006, correction_rad = 0.003;  ///< the same of what the core says
  double least_m = 0.002, least_rad = 0.001;            ///< no pose is better known than this, however often measured
  /// Squared distance, of 6 dimensions, beyond which a measurement does not fit (one right one in 10 000).
  double fits = 27.9;
};

/// How far an odometry has gone.
struct Odometer {
  double walked_m = 0, turned_rad = 0;
  int blind_frames = 0;
};

/// Thread rule: one thread.
class MapFilter {
 public:
  explicit MapFilter(const MapFilterOptions& options) : options_(options) {}

  /// The camera is at T_odom_cam now; `blind`: that is a prediction.
  void move(const Pose& T_odom_cam, bool blind);

  /// Believes T_map_odom and nothing else, as well as after `since` of odometry from a correction.
  void set(const Pose& T_map_odom, const Odometer& since);

  /// The core's word about a keyframe `since` ago: weighed in if it fits what is believed, else believed alone. True if
  /// it fitted.
  bool correct(const Pose& T_map_odom, const Odometer& since);

  /// A registration of the frame that move() was last called with; `information` is for T_map_cam exp(xi). False,
  /// without effect, if it does not fit. The less it stands out from its own error, the less of it is taken.
  bool measure(const Pose& T_map_cam, const Matrix6d& information);

  const Pose& T_map_odom() const { return T_map_odom_; }
  Pose T_map_cam() const { return T_map_odom_ * T_odom_cam_; }
  /// Of T_map_cam() for an increment at the camera, T_map_cam exp(xi).
  const Matrix6d& covariance() const { return covariance_; }
  const Odometer& odometer() const { return odometer_; }

 private:
  Matrix6d drift(const Odometer& since) const;
  /// `taken`: share of the step, 0..1.
  bool weigh(const Pose& T_map_cam, const Matrix6d& covariance, double taken);

  MapFilterOptions options_;
  Pose T_map_odom_, T_odom_cam_;
  Matrix6d covariance_ = Matrix6d::Identity();
  Odometer odometer_;
};

/// The way from `earlier` to `later`.
Odometer between(const Odometer& earlier, const Odometer& later);

}  // namespace comap
