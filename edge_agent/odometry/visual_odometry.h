// The robot's own motion: each frame is aligned to the current keyframe, which becomes the edge's honest measurement.
// The keyframe's depth is the mean of all frames of its window and of the keyframe before it.
#pragma once

#include <cstdint>
#include <vector>

#include "edge_agent/odometry/super_keyframe.h"
#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "mapping_core/rgbd/rotation_alignment.h"
#include "mapping_core/rgbd/row_workers.h"
#include "protocol/types/image.h"
#include "protocol/types/messages.h"

namespace comap {

struct OdometryOptions {
  float depth_min_m = 0.3f;
  float depth_max_m = 6.0f;
  ReferenceOptions reference;
  AlignmentOptions alignment;
  RotationOptions rotation;
  float inherited_frames = 4;  ///< as how many frames a keyframe's depth counts in the next one's; 0: not at all
  double poor_inlier_ratio = 0.5;
  double poor_free_inlier_ratio = 0.8;  ///< the same where directions are free: little is left that could contradict
  double poor_rms_sigma = 1.5;
  double poor_photometric = 20;            ///< grey levels: geometry may fit where the picture does not
  double jump_m = 0.15, jump_rad = 0.175;  ///< against constant velocity; more is not believed
  int lost_after = 10;                     ///< consecutive poor frames
  int threads = 1;                         ///< that share a frame's rows; poses do not depend on it
};

struct TrackedFrame {
  Pose T_odom_cam;
  Pose T_keyframe_cam;  ///< in the keyframe that was current when the frame arrived
  Alignment alignment;
  TrackingState state = TrackingState::kOk;
  bool first = false;       ///< started a chain: nothing to align to
  bool aligned = false;     ///< the pose is that of an alignment that passed; else it is where constant motion would be
  bool changed = false;     ///< aligned, but with another state than the frame that was aligned before
  bool degenerate = false;  ///< some direction is not determined by what is in view: there the pose is a prediction
};

/// Thread rule: one caller at a time. Allocates nothing per frame after the first few.
class VisualOdometry {
 public:
  explicit VisualOdometry(const OdometryOptions& options)
      : options_(options), workers_(options.threads), keyframe_depth_(options.alignment.noise, &workers_) {}

  /// Tracks one frame. If there is nothing to track against, the frame starts a chain at the last known pose, or is
  /// LOST if it has too little depth for that.
  TrackedFrame track(const Frame& frame);

  /// Averages the frame just tracked into the keyframe's depth, if it was tracked well. The reference that the next
  /// frames are aligned to stays as it is: one that changes within a window adds its changes to the measurement.
  void addToKeyframe(const TrackedFrame& tracked);

  /// Makes the frame just tracked the keyframe that the next ones are aligned to; its depth takes in that of the
  /// keyframe before if the frame was tracked well.
  void makeKeyframe(const TrackedFrame& tracked);

  /// Lets a frame that track() called the first of a chain stand at a pose that was found otherwise.
  void resume(const Pose& T_odom_cam) { T_odom_last_ = T_odom_cam; }

  /// The frame just tracked.
  const Pyramid& live() const { return live_; }

  /// Of the current keyframe, with all frames averaged in so far.
  const SuperKeyframe& keyframeDepth() const { return keyframe_depth_; }

  const Pose& T_odom_keyframe() const { return T_odom_keyframe_; }

 private:
  struct Attempt {
    Alignment alignment;
    bool good = false;  // solved, no jump, all gates passed
  };
  Attempt alignFrom(const Pose& T_odom_guess);
  Pose predictByRotation(const Pose& T_odom_predicted);
  bool isGood(const TrackedFrame& tracked) const { return tracked.aligned && tracked.state == TrackingState::kOk; }

  OdometryOptions options_;
  RowWorkers workers_;
  Pyramid live_, keyframe_;
  ReferenceView reference_;
  PointResiduals workspace_;
  std::vector<PickedPoint> picked_workspace_;
  SuperKeyframe keyframe_depth_;
  Image<float> previous_grey_;  // of the frame before, coarsest level
  RotationWorkspace rotation_workspace_;
  PyramidLevel inherited_;  // depth of the keyframe before, level 0
  bool has_reference_ = false;
  Pose T_odom_keyframe_, T_odom_last_;
  Vector6d velocity_ = Vector6d::Zero();  // log of the last frame-to-frame motion
  int poor_in_a_row_ = 0;
  TrackingState aligned_state_ = TrackingState::kOk;  // of the last frame that was aligned
};

}  // namespace comap
