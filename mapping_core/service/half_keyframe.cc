#include "mapping_core/service/half_keyframe.h"

#include <algorithm>
#include <array>
#include <limits>

namespace comap {
namespace {

template <class T>
std::array<T, 4> fourOf(const Image<T>& image, int x, int y) {
  return {image.at(2 * x, 2 * y), image.at(2 * x + 1, 2 * y), image.at(2 * x, 2 * y + 1),
          image.at(2 * x + 1, 2 * y + 1)};
}

Rgb meanOf(const std::array<Rgb, 4>& four) {
  uint32_t r = 2, g = 2, b = 2;  // rounded
  for (const Rgb& c : four) {
    r += c.r;
    g += c.g;
    b += c.b;
  }
  return {static_cast<uint8_t>(r / 4), static_cast<uint8_t>(g / 4), static_cast<uint8_t>(b / 4)};
}

// 2 cm at the camera, 3 cm at 1 m, growing as the noise of such sensors does.
uint16_t depthOf(const std::array<uint16_t, 4>& four) {
  constexpr uint32_t kNone = std::numeric_limits<uint16_t>::max();
  constexpr auto kUnits = static_cast<uint32_t>(kDepthUnitsPerMetre);
  uint32_t nearest = kNone;
  for (const uint16_t d : four)
    if (d > 0) nearest = std::min<uint32_t>(nearest, d);
  const uint32_t farthest = nearest + kUnits / 50 + nearest * nearest / kUnits / 100;
  uint32_t sum = 0, count = 0;
  for (const uint16_t d : four) {
    if (d == 0 || d > farthest) continue;
    sum += d;
    ++count;
  }
  return count > 0 ? static_cast<uint16_t>((sum + count / 2) / count) : uint16_t{0};
}

// Of the four blocks of pixels that one of the half picture covers, what the least agreed one has.
Image<uint8_t> hitsOf(const Image<uint8_t>& hits, int width, int height) {
  Image<uint8_t> half((width + kHitBlock - 1) / kHitBlock, (height + kHitBlock - 1) / kHitBlock);
  for (int y = 0; y < half.height(); ++y)
    for (int x = 0; x < half.width(); ++x) {
      uint8_t fewest = std::numeric_limits<uint8_t>::max();
      for (int v = 2 * y; v < std::min(2 * y + 2, hits.height()); ++v)
        for (int u = 2 * x; u < std::min(2 * x + 2, hits.width()); ++u) fewest = std::min(fewest, hits.at(u, v));
      half.at(x, y) = fewest;
    }
  return half;
}

}  // namespace

Keyframe halved(const Keyframe& keyframe) {
  Keyframe half;
  half.id = keyframe.id;
  half.camera = keyframe.camera.shrunk(2);
  half.colour = ColourImage(half.camera.width, half.camera.height);
  half.depth = DepthImage(half.camera.width, half.camera.height);
  for (int y = 0; y < half.camera.height; ++y)
    for (int x = 0; x < half.camera.width; ++x) {
      half.colour.at(x, y) = meanOf(fourOf(keyframe.colour, x, y));
      half.depth.at(x, y) = depthOf(fourOf(keyframe.depth, x, y));
    }
  if (!keyframe.depth_hits.empty())
    half.depth_hits = hitsOf(keyframe.depth_hits, half.camera.width, half.camera.height);
  return half;
}

}  // namespace comap
