// What a robot ships: a keyframe with its fern code and the odometry edge to the keyframe before it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "protocol/types/ids.h"
#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

/// One randomised-fern code of an image: per fern 4 bits (R, G, B, depth above their thresholds), or kBad where the
/// pixel has no depth. Codes are comparable only if made with one book: `book_hash` says which.
struct FernCode {
  static constexpr uint8_t kBad = 0xff;
  uint64_t book_hash = 0;
  std::vector<uint8_t> codes;  ///< one per fern, 0..15 or kBad
  bool operator==(const FernCode&) const = default;
};

struct Keyframe {
  KeyframeId id;
  int64_t stamp_ns = 0;
  CameraModel camera;
  ColourImage colour;
  DepthImage depth;
  FernCode fern_code;

  /// Pose in the robot's own odometry frame, which is never rewritten.
  Pose T_odom_cam;
  /// False for the first keyframe of a chain (start, or tracking was lost): nothing ties it to the one before.
  bool linked = false;
  /// Pose of this camera in the previous keyframe's camera, if linked.
  Pose T_prev_this;
  /// Information (inverse covariance) of T_prev_this for the left increment exp(xi) T_prev_this, order (rho, phi).
  Matrix6d information = Matrix6d::Identity();
  /// Share of reference points that agreed with the frame, 0..1.
  double inlier_ratio = 0;
};

}  // namespace comap
