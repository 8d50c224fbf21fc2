// What a keyframe hangs on: the odometry from an earlier one.
#pragma once

#include <cstdint>

#include "protocol/types/pose.h"

namespace comap {

/// A keyframe's link to another one of its session, or that it has none.
struct KeyframeLink {
  bool linked = false;
  uint32_t linked_to = 0;
  Pose T_link_this;
  Matrix6d information = Matrix6d::Identity();
};

/// The odometry from one keyframe to another, over a third: information adds up as covariances do.
KeyframeLink joinLinks(const KeyframeLink& first, const KeyframeLink& second);

}  // namespace comap
