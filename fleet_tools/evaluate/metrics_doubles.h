// How much of a map's surface lies twice: a second wall close behind the first, as poses that disagree leave it.
#pragma once

#include <cstddef>

#include "fleet_tools/export/ply.h"

namespace comap {

/// Nearer than this it is the noise of one surface, farther another surface; metres along the normal.
inline constexpr float kDoubleNearest_m = 0.01f, kDoubleFarthest_m = 0.03f;
inline constexpr float kDoubleCosine = 0.866f;       ///< 30 degrees: facing the same way
inline constexpr float kDoubleReach_m = 0.01f;       ///< sideways, where points have no radius
inline constexpr float kMostDoubleReach_m = 0.025f;  ///< sideways at most

struct DoubleSurface {
  size_t points = 0;   ///< with a normal
  size_t doubled = 0;  ///< that lie behind another's disc
  double share() const { return points ? static_cast<double>(doubled) / static_cast<double>(points) : 0; }
};

/// A point is doubled if another that faces the same way has it 1 to 3 cm behind itself, within the other's radius.
DoubleSurface findDoubles(const PlyPoints& map, int threads);

}  // namespace comap
