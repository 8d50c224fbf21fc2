#include "fleet_tools/synth/synth_noise.h"

#include <algorithm>
#include <cmath>

#include "fleet_tools/synth/synth_parallel.h"
#include "fleet_tools/synth/synth_random.h"

namespace comap {
namespace {

constexpr float kJitter_px = 0.5f;
constexpr float kDisparity_cm = 35130.0f;  // depth in cm times disparity in steps
constexpr float kDisparityNoise = 1.0f / 6.0f;
constexpr float kNearest_m = 0.4f, kFarthest_m = 4.5f;
constexpr float kLeastCosine = 0.1392f;  // of 82 degrees
// A surface at 82 degrees changes its depth by 1.4 % from pixel to pixel at this focal length.
constexpr float kEdgeJump = 0.025f;
constexpr float kColourNoise = 1.2f;

uint16_t toUnit(float depth_m) {
  const float units = std::floor(depth_m * static_cast<float>(kDepthUnitsPerMetre) + 0.5f);
  return units >= 1 && units <= 65535 ? static_cast<uint16_t>(units) : uint16_t{0};
}

// Four normal numbers of one 64-bit number.
float normalPart(const float* table, uint64_t bits, int part) {
  return table[(bits >> (16 * part)) & (kNormalEntries - 1)];
}

uint16_t sensed(const SynthView& view, int x, int y, const float* table, uint64_t bits) {
  const int width = view.depth_m.width(), height = view.depth_m.height();
  if (view.cosine.at(x, y) < kLeastCosine) return 0;
  const float u =
      std::clamp(static_cast<float>(x) + kJitter_px * normalPart(table, bits, 0), 0.0f, static_cast<float>(width - 1));
  const float v =
      std::clamp(static_cast<float>(y) + kJitter_px * normalPart(table, bits, 1), 0.0f, static_cast<float>(height - 1));
  const int x0 = std::min(static_cast<int>(u), width - 2), y0 = std::min(static_cast<int>(v), height - 2);
  const float* top = view.depth_m.row(y0) + x0;
  const float* bottom = view.depth_m.row(y0 + 1) + x0;
  const float least = std::min({top[0], top[1], bottom[0], bottom[1]});
  const float most = std::max({top[0], top[1], bottom[0], bottom[1]});
  if (least <= 0 || most - least > kEdgeJump * least) return 0;
  const float s = u - static_cast<float>(x0), t = v - static_cast<float>(y0);
  const float z = (top[0] * (1 - s) + top[1] * s) * (1 - t) + (bottom[0] * (1 - s) + bottom[1] * s) * t;
  if (z < kNearest_m || z > kFarthest_m) return 0;
  const float step = std::floor(kDisparity_cm / (100 * z) + kDisparityNoise * normalPart(table, bits, 2) + 0.5f);
  return toUnit(kDisparity_cm / step / 100);
}

}  // namespace

DepthImage exactDepth(const SynthView& view, int threads) {
  DepthImage depth(view.depth_m.width(), view.depth_m.height());
  parallelFor(depth.height(), threads, [&](int y) {
    for (int x = 0; x < depth.width(); ++x) depth.at(x, y) = toUnit(view.depth_m.at(x, y));
  });
  return depth;
}

DepthImage kinectDepth(const SynthView& view, uint64_t key, int threads) {
  DepthImage depth(view.depth_m.width(), view.depth_m.height());
  const float* table = normalTable();
  parallelFor(depth.height(), threads, [&](int y) {
    for (int x = 0; x < depth.width(); ++x) {
      const auto pixel = static_cast<uint64_t>(y * depth.width() + x);
      depth.at(x, y) = sensed(view, x, y, table, mixBits(key + pixel));
    }
  });
  return depth;
}

void addColourNoise(ColourImage& colour, uint64_t key, int threads) {
  const float* table = normalTable();
  parallelFor(colour.height(), threads, [&](int y) {
    for (int x = 0; x < colour.width(); ++x) {
      const uint64_t bits = mixBits(key + static_cast<uint64_t>(y * colour.width() + x));
      Rgb& pixel = colour.at(x, y);
      const auto noisy = [&](uint8_t value, int part) {
        const float level = static_cast<float>(value) + kColourNoise * normalPart(table, bits, part);
        return static_cast<uint8_t>(std::clamp(std::floor(level + 0.5f), 0.0f, 255.0f));
      };
      pixel = {noisy(pixel.r, 0), noisy(pixel.g, 1), noisy(pixel.b, 2)};
    }
  });
}

}  // namespace comap
