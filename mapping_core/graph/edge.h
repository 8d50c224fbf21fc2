// An edge of the keyframe graph: a relative pose and how well it is known.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/types/ids.h"
#include "protocol/types/pose.h"

namespace comap {

/// kCovisibility: neighbours in space of one map, aligned again at the map's own poses.
enum class EdgeKind : uint8_t { kOdometry = 0, kLoop = 1, kInterRobot = 2, kCovisibility = 3 };
inline constexpr size_t kEdgeKinds = 4;

struct Edge {
  KeyframeId from, to;
  EdgeKind kind = EdgeKind::kOdometry;
  Pose T_from_to;
  /// Inverse covariance of T_from_to for the left increment exp(xi) T_from_to, order (rho, phi).
  Matrix6d information = Matrix6d::Identity();
  uint32_t merge = 0;  ///< number of the merge whose closure this is; 0: none
};

}  // namespace comap
