// When each camera last saw a surfel: what makes a part of a map active for one camera and inactive for another.
#pragma once

#include <array>
#include <cstdint>

namespace comap {

/// Cameras whose times a map can hold, and the last tick it can tell.
inline constexpr uint32_t kMostCameras = 8;
inline constexpr uint32_t kLastTick = 65535;

/// Tick of each camera, 0 = never.
using SeenTimes = std::array<uint16_t, kMostCameras>;

enum class SeenBy { kAny, kActive, kInactive };

/// Active for a camera is what it has updated within `window` ticks before `tick`; inactive all else, also what other
/// cameras are updating right now.
struct SeenFilter {
  SeenBy which = SeenBy::kAny;
  uint32_t camera = 0;
  uint32_t tick = 1;  ///< now, from 1 on
  uint32_t window = 200;
};

}  // namespace comap
