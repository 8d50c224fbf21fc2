#include "edge_agent/odometry/visual_odometry.h"

namespace comap {
namespace {

bool hasEnoughDepth(const PyramidLevel& level) {
  constexpr size_t kOneIn = 20;
  size_t valid = 0;
  for (size_t i = 0; i < level.depth_m.size(); ++i) valid += level.depth_m.data()[i] > 0;
  return valid * kOneIn > level.depth_m.size();
}

}  // namespace

TrackedFrame VisualOdometry::track(const Frame& frame) {
  buildPyramid(frame.colour, frame.depth, frame.camera, options_.reference.coarsest_level + 1, options_.depth_min_m,
               options_.depth_max_m, live_);
  TrackedFrame tracked;
  if (!has_reference_) {
    tracked.T_odom_cam = T_odom_last_;
    velocity_.setZero();
    tracked.first = hasEnoughDepth(live_.back());
    if (!tracked.first) tracked.state = TrackingState::kLost;  // nothing to start from: wait for a better frame
    return tracked;
  }
  const Pose T_odom_predicted = T_odom_last_ * Pose::exp(velocity_);
  const Pose T_keyframe_odom = T_odom_keyframe_.inverse();
  tracked.alignment = align(reference_, live_, T_keyframe_odom * T_odom_predicted, options_.alignment, workspace_);
  const Alignment& a = tracked.alignment;
  const Pose T_odom_cam = T_odom_keyframe_ * a.T_ref_cur;
  const Pose jump = T_odom_predicted.inverse() * T_odom_cam;
  const bool believable = a.solved && a.T_ref_cur.isFinite() && jump.translation().norm() < options_.jump_m &&
                          jump.angle() < options_.jump_rad;
  const bool good = believable && a.inlier_ratio >= options_.poor_inlier_ratio &&
                    a.rms_sigma <= options_.poor_rms_sigma && a.degeneracy >= options_.poor_degeneracy &&
                    a.photometric_median <= options_.poor_photometric;
  tracked.aligned = believable;
  if (believable) {
    tracked.T_odom_cam = T_odom_cam;
    velocity_ = (T_odom_last_.inverse() * T_odom_cam).log();
  } else {
    tracked.T_odom_cam = T_odom_predicted;
    velocity_ *= 0.5;  // coast, and come to rest rather than fly off
  }
  poor_in_a_row_ = good ? 0 : poor_in_a_row_ + 1;
  tracked.state = good                                   ? TrackingState::kOk
                  : poor_in_a_row_ > options_.lost_after ? TrackingState::kLost
                                                         : TrackingState::kPoor;
  if (tracked.state == TrackingState::kLost) {
    // The next usable frame begins a new chain; the core may tie it back, the robot does not pretend to know.
    has_reference_ = false;
    poor_in_a_row_ = 0;
  }
  tracked.T_keyframe_cam = T_keyframe_odom * tracked.T_odom_cam;
  T_odom_last_ = tracked.T_odom_cam;
  return tracked;
}

void VisualOdometry::makeKeyframe() {
  reference_ = buildReference(live_, options_.reference, options_.alignment.noise);
  T_odom_keyframe_ = T_odom_last_;
  has_reference_ = true;
}

}  // namespace comap
