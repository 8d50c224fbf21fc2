// From a camera's pixels to the project's: 8-bit RGB, 16-bit depth values. Buffers are untrusted: nothing beyond
// their end is read.
#pragma once

#include "edge_agent/capture/picture.h"
#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

/// YUV after BT.601, each channel rounded to the nearest value (at most 1 off from real arithmetic); chroma of
/// subsampled formats is that of the block. kBadData if the buffer is too short, odd in size, or the JPEG is damaged or
/// of another size than the picture says; kWrongUse for a depth format.
Result<ColourImage> toColour(const Picture& picture);

/// The values as the device counts them (their unit is the caller's knowledge). kBadData if the buffer is too short,
/// kWrongUse for a colour format.
Result<DepthImage> toDepthValues(const Picture& picture);

}  // namespace comap
