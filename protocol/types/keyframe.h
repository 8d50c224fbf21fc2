// What a robot ships: a keyframe with its fern code and the odometry edge to the keyframe before it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "protocol/types/fern_code.h"
#include "protocol/types/ids.h"
#include "protocol/types/image.h"
#include "protocol/types/map_pose.h"
#include "protocol/types/pose.h"

namespace comap {

inline constexpr int kHitBlock = 4;

struct Keyframe {
  KeyframeId id;
  int64_t stamp_ns = 0;
  CameraModel camera;
  ColourImage colour;
  DepthImage depth;  ///< the mean of the frames until the next keyframe, warped into this one
  /// How many frames agree on the depth in each block of kHitBlock x kHitBlock pixels: the fewest of its pixels that
  /// have depth, 0 if none has. Empty: depth is that of one frame.
  Image<uint8_t> depth_hits;
  FernCode fern_code;

  /// Pose in the robot's own odometry frame, which is never rewritten.
  Pose T_odom_cam;
  /// False for the first keyframe of a chain (start, or tracking was lost): nothing ties it to an earlier one.
  bool linked = false;
  /// Sequence of the keyframe of the same session that it is tied to, if linked: the one before, or, where that one was
  /// dropped for want of room, an earlier one.
  uint32_t linked_to = 0;
  /// Pose of this camera in that keyframe's camera, if linked.
  Pose T_link_this;
  /// Information (inverse covariance) of T_link_this for the left increment exp(xi) T_link_this, order (rho, phi).
  Matrix6d information = Matrix6d::Identity();
  /// Share of reference points that agreed with the frame, 0..1.
  double inlier_ratio = 0;
  /// How many sequences right before this one do not exist: the robot dropped them for want of room, and tied what
  /// was linked to them to the keyframes before.
  uint32_t skipped = 0;
  /// Where the robot believes this camera to stand in a map that no edge of its own ties it to: it has recognised the
  /// place, in its tiles or its own memory. A hint where to look for a match, no measurement.
  std::optional<MapPose> believed;
};

}  // namespace comap
