// The robot's own motion: each frame is aligned to the current keyframe, which becomes the edge's honest measurement.
#pragma once

#include <cstdint>

#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "protocol/types/image.h"
#include "protocol/types/messages.h"

namespace comap {

struct OdometryOptions {
  float depth_min_m = 0.3f;
  float depth_max_m = 6.0f;
  ReferenceOptions reference;
  AlignmentOptions alignment;
  double poor_inlier_ratio = 0.5;
  double poor_rms_sigma = 1.5;
  double poor_degeneracy = 1e-4;
  double poor_photometric = 20;            ///< grey levels: geometry may fit where the picture does not
  double jump_m = 0.15, jump_rad = 0.175;  ///< against constant velocity; more is not believed
  int lost_after = 10;                     ///< consecutive poor frames
};

struct TrackedFrame {
  Pose T_odom_cam;
  Pose T_keyframe_cam;  ///< in the keyframe that was current when the frame arrived
  Alignment alignment;
  TrackingState state = TrackingState::kOk;
  bool first = false;    ///< started a chain: nothing to align to
  bool aligned = false;  ///< the pose is that of the alignment; else it is where constant motion would be
};

/// Thread rule: one thread. Allocates nothing per frame after the first few.
class VisualOdometry {
 public:
  explicit VisualOdometry(const OdometryOptions& options) : options_(options) {}

  /// Tracks one frame. If there is nothing to track against, the frame starts a chain at the last known pose, or is
  /// LOST if it has too little depth for that.
  TrackedFrame track(const Frame& frame);

  /// Makes the frame just tracked the keyframe that the next ones are aligned to.
  void makeKeyframe();

  const Pose& T_odom_keyframe() const { return T_odom_keyframe_; }

 private:
  OdometryOptions options_;
  Pyramid live_;
  ReferenceView reference_;
  PointResiduals workspace_;
  bool has_reference_ = false;
  Pose T_odom_keyframe_, T_odom_last_;
  Vector6d velocity_ = Vector6d::Zero();  // log of the last frame-to-frame motion
  int poor_in_a_row_ = 0;
};

}  // namespace comap
