// Which camera at which tick: what a surfel's owner and a pose's place in time are told by.
#pragma once

#include <cstdint>

namespace comap {

struct FrameTime {
  uint32_t camera = 0;
  uint32_t tick = 0;
};

}  // namespace comap
