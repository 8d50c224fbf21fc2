// Depth images <-> bytes, lossless. Layout: docs/wire.md, "Depth".
// Sensors know few distinct depths, so each pixel becomes its rank among the levels that occur (this takes in any
// common divisor), is predicted from its neighbours, and the residuals go through zstd.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

/// kWrongUse for sides beyond limits.h. The smallest of the prediction and packing candidates.
Result<std::vector<uint8_t>> encodeDepth(const DepthImage& depth);

/// kBadData unless `bytes` holds a whole depth image of exactly `width` x `height` pixels.
Result<DepthImage> decodeDepth(std::span<const uint8_t> bytes, int width, int height);

}  // namespace comap
