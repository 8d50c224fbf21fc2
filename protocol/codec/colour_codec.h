// Colour images <-> JPEG (libjpeg-turbo), 4:2:0.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

inline constexpr int kDefaultJpegQuality = 90;

/// `quality` 1..100. kWrongUse for another quality or sides beyond limits.h.
Result<std::vector<uint8_t>> encodeColour(const ColourImage& image, int quality = kDefaultJpegQuality);

/// kBadData unless `bytes` is a whole JPEG of exactly `width` x `height` pixels, read from its header before memory
/// is taken.
Result<ColourImage> decodeColour(std::span<const uint8_t> bytes, int width, int height);

}  // namespace comap
