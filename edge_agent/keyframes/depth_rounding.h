// Depth as a keyframe carries it: mean depth has more digits than meaning, and digits cost bytes.
#pragma once

#include "protocol/types/image.h"

namespace comap {

struct DepthRounding {
  /// Steps in inverse depth (1/m): 1.1 mm at 1 m, 4.4 mm at 2 m; 0.4 of the step of a structured-light sensor.
  float step_per_m = 0.0011f;
  /// A pixel takes the value that its neighbours predict if that is at most so many steps farther off than the nearest
  /// one may be: plain surfaces become plain numbers. The error is at most tolerance + 1/2 steps.
  float tolerance = 0.3f;
};

/// `depth_m`: metres, 0 = none. Depths that the unit cannot hold (13.1 m and more) become none.
DepthImage roundDepth(const Image<float>& depth_m, const DepthRounding& rounding);

/// The least value other than 0 of each block of `side` x `side` pixels, 0 where there is none.
Image<uint8_t> fewestOfBlocks(const Image<uint8_t>& hits, int side);

}  // namespace comap
