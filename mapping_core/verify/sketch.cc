#include "mapping_core/verify/sketch.h"

#include <algorithm>

namespace comap {
namespace {

constexpr size_t kSketchLevel = 3;

template <class Visit>
void forNeighbours(int width, int height, int x, int y, const Visit& visit) {
  for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) visit(u, v);
}

ColourImage shrink(const ColourImage& colour, int width, int height) {
  constexpr int kBlock = 1 << kSketchLevel;
  ColourImage small(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      uint32_t r = 0, g = 0, b = 0;
      for (int v = 0; v < kBlock; ++v)
        for (int u = 0; u < kBlock; ++u) {
          const Rgb& pixel = colour.at(x * kBlock + u, y * kBlock + v);
          r += pixel.r;
          g += pixel.g;
          b += pixel.b;
        }
      constexpr uint32_t kPixels = kBlock * kBlock;
      small.at(x, y) = {static_cast<uint8_t>(r / kPixels), static_cast<uint8_t>(g / kPixels),
                        static_cast<uint8_t>(b / kPixels)};
    }
  return small;
}

}  // namespace

Sketch makeSketch(const Keyframe& keyframe, const Pyramid& pyramid, const DepthNoiseModel& noise) {
  const PyramidLevel& level = pyramid[kSketchLevel];
  const int width = level.depth_m.width(), height = level.depth_m.height();
  Sketch sketch;
  sketch.id = keyframe.id;
  sketch.camera = level.camera;
  sketch.depth_m = Image<float>(width, height);
  sketch.nearest_m = Image<float>(width, height);
  sketch.colour = shrink(keyframe.colour, width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float own = level.depth_m.at(x, y);
      float near = 0, far = 0;
      forNeighbours(width, height, x, y, [&](int u, int v) {
        const float d = level.depth_m.at(u, v);
        if (d <= 0) return;
        near = near > 0 ? std::min(near, d) : d;
        far = std::max(far, d);
      });
      sketch.nearest_m.at(x, y) = near;
      // A plane seen at 80 degrees rises by 5.7 cells' width from one cell to the next, here over three.
      const float slope = 12 * own / static_cast<float>(level.camera.fx);
      const bool edge = far - near > 0.05f + slope + 3 * noise.sigma(own);
      if (own > 0 && !edge) sketch.depth_m.at(x, y) = own;
    }
  return sketch;
}

}  // namespace comap
