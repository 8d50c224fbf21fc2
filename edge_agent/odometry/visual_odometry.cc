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
  // The grey picture of the frame before is all that is needed of it.
  if (!live_.empty()) std::swap(previous_grey_, live_.back().grey);
  buildPyramid(frame.colour, frame.depth, frame.camera, options_.reference.coarsest_level + 1, options_.depth_min_m,
               options_.depth_max_m, live_, &workers_);
  TrackedFrame tracked;
  if (!has_reference_) {
    tracked.T_odom_cam = T_odom_last_;
    velocity_.setZero();
    tracked.first = hasEnoughDepth(live_.back());
    aligned_state_ = TrackingState::kOk;
    if (!tracked.first) tracked.state = TrackingState::kLost;  // nothing to start from: wait for a better frame
    return tracked;
  }
  const Pose T_odom_predicted = T_odom_last_ * Pose::exp(velocity_);
  Attempt attempt = alignFrom(T_odom_predicted);
  if (!attempt.good) {
    // Constant velocity was perhaps a bad guess: the picture alone tells how far the camera has turned.
    const Attempt turned = alignFrom(predictByRotation(T_odom_predicted));
    if (turned.good) attempt = turned;
  }
  tracked.alignment = attempt.alignment;
  // A pose that does not pass the gates is a wrong one more often than not: it must move neither the robot nor the
  // prediction, and no keyframe may stand on it.
  tracked.aligned = attempt.good;
  tracked.degenerate = attempt.good && attempt.alignment.free_directions > 0;
  if (attempt.good) {
    tracked.T_odom_cam = T_odom_keyframe_ * attempt.alignment.T_ref_cur;
    velocity_ = (T_odom_last_.inverse() * tracked.T_odom_cam).log();
    if (tracked.degenerate) velocity_ *= 0.9;  // partly a guess that would feed itself
  } else {
    tracked.T_odom_cam = T_odom_predicted;
    velocity_ *= 0.5;  // coast, and come to rest rather than fly off
  }
  // What is determined but for some directions is poor, yet no reason to give the chain up: its information says so.
  poor_in_a_row_ = attempt.good ? 0 : poor_in_a_row_ + 1;
  tracked.state = attempt.good && !tracked.degenerate    ? TrackingState::kOk
                  : poor_in_a_row_ > options_.lost_after ? TrackingState::kLost
                                                         : TrackingState::kPoor;
  if (tracked.aligned) {
    tracked.changed = tracked.state != aligned_state_;
    aligned_state_ = tracked.state;
  }
  if (tracked.state == TrackingState::kLost) {
    // The next usable frame begins a new chain; the core may tie it back, the robot does not pretend to know.
    has_reference_ = false;
    poor_in_a_row_ = 0;
  }
  tracked.T_keyframe_cam = T_odom_keyframe_.inverse() * tracked.T_odom_cam;
  T_odom_last_ = tracked.T_odom_cam;
  return tracked;
}

VisualOdometry::Attempt VisualOdometry::alignFrom(const Pose& T_odom_guess) {
  Attempt attempt;
  attempt.alignment =
      align(reference_, live_, T_odom_keyframe_.inverse() * T_odom_guess, options_.alignment, workspace_);
  const Alignment& a = attempt.alignment;
  const Pose jump = T_odom_guess.inverse() * T_odom_keyframe_ * a.T_ref_cur;
  const double least_inliers = a.free_directions > 0 ? options_.poor_free_inlier_ratio : options_.poor_inlier_ratio;
  attempt.good = a.solved && a.T_ref_cur.isFinite() && jump.translation().norm() < options_.jump_m &&
                 jump.angle() < options_.jump_rad && a.inlier_ratio >= least_inliers &&
                 a.rms_sigma <= options_.poor_rms_sigma && a.photometric_median <= options_.poor_photometric;
  return attempt;
}

Pose VisualOdometry::predictByRotation(const Pose& T_odom_predicted) {
  const Pose predicted = T_odom_last_.inverse() * T_odom_predicted;
  const PyramidLevel& coarsest = live_.back();
  const RotationAlignment rotation = alignRotation(coarsest.camera, previous_grey_, coarsest.grey,
                                                   predicted.rotationMatrix(), options_.rotation, rotation_workspace_);
  return T_odom_last_ * Pose(Eigen::Quaterniond(rotation.R_previous_current), predicted.translation());
}

void VisualOdometry::addToKeyframe(const TrackedFrame& tracked) {
  if (isGood(tracked)) keyframe_depth_.add(live_.front(), tracked.T_keyframe_cam);
}

void VisualOdometry::makeKeyframe(const TrackedFrame& tracked) {
  const bool inherits = has_reference_ && isGood(tracked) && options_.inherited_frames > 0;
  if (inherits) {
    inherited_.camera = keyframe_depth_.camera();
    keyframe_depth_.writeDepth(inherited_.depth_m);
  }
  keyframe_depth_.start(live_.front());
  if (inherits) keyframe_depth_.inherit(inherited_, tracked.T_keyframe_cam.inverse(), options_.inherited_frames);
  keyframe_.resize(live_.size());
  for (size_t l = 0; l < live_.size(); ++l) {
    keyframe_[l].camera = live_[l].camera;
    keyframe_[l].grey = live_[l].grey;
  }
  keyframe_depth_.writeDepth(keyframe_.front().depth_m);
  shrinkDepth(keyframe_, &workers_);
  buildReference(keyframe_, options_.reference, options_.alignment.noise, &workers_, picked_workspace_, reference_);
  T_odom_keyframe_ = T_odom_last_;
  has_reference_ = true;
}

}  // namespace comap
