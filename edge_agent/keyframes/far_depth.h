// Depth too far to be tracked on and fused. It is no surface, but it proves that the space before it is free: what was
// mapped there and has been taken away would else stay for ever.
#pragma once

#include "protocol/types/image.h"

namespace comap {

/// What of `depth` lies beyond `range_m`, 0 elsewhere; reuses the image's memory.
void takeFarDepth(const DepthImage& depth, float range_m, DepthImage& far);

/// Fills the pixels of `depth_m` that have none (0) with what `far` has there. Both have one size.
void fillFarDepth(const DepthImage& far, Image<float>& depth_m);

}  // namespace comap
