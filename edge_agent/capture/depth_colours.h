// Depth made visible.
#pragma once

#include <algorithm>
#include <cmath>

#include "protocol/types/image.h"

namespace comap {

/// Red at 0.3 m and nearer, over yellow, green and cyan to blue at 6 m and farther, even in 1/z; black without depth.
inline Rgb depthColour(uint16_t depth) {
  if (depth == 0) return {};
  constexpr double kNear_m = 0.3, kFar_m = 6;
  const double z_m = std::clamp(depth / kDepthUnitsPerMetre, kNear_m, kFar_m);
  const double far = (1 / kNear_m - 1 / z_m) / (1 / kNear_m - 1 / kFar_m);  // 0 near, 1 far
  const double hue = 4 * far;                                               // in sixths of the circle
  const auto channel = [&](double centre) {
    const double away = std::abs(hue - centre);
    return static_cast<uint8_t>(255 * std::clamp(2 - away, 0.0, 1.0));
  };
  return {channel(0), channel(2), channel(4)};
}

}  // namespace comap
