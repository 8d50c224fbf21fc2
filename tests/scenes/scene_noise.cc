#include "tests/scenes/scene_noise.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace comap {
namespace {

constexpr double kLateralSigma_px = 0.5;
constexpr double kDisparityScale_cm = 35130, kDisparitySigma = 1.0 / 6;
constexpr double kColourSigma = 2;

uint8_t toByte(double grey) { return static_cast<uint8_t>(std::clamp(std::lround(grey), 0l, 255l)); }

// Depth units at a continuous pixel; the nearest pixel's where one of the four is missing.
double bilinear(const DepthImage& depth, double u, double v) {
  u = std::clamp(u, 0.0, depth.width() - 1.001);
  v = std::clamp(v, 0.0, depth.height() - 1.001);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const double d00 = depth.at(x, y), d10 = depth.at(x + 1, y), d01 = depth.at(x, y + 1), d11 = depth.at(x + 1, y + 1);
  if (d00 == 0 || d10 == 0 || d01 == 0 || d11 == 0) return depth.at(x + (a > 0.5), y + (b > 0.5));
  return (1 - b) * ((1 - a) * d00 + a * d10) + b * ((1 - a) * d01 + a * d11);
}

}  // namespace

void addKinectNoise(Frame& frame, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const DepthImage exact = frame.depth;
  for (int y = 0; y < exact.height(); ++y)
    for (int x = 0; x < exact.width(); ++x) {
      const double du = kLateralSigma_px * normal(random), dv = kLateralSigma_px * normal(random);
      const double cm = bilinear(exact, x + du, y + dv) * 100 / kDepthUnitsPerMetre;
      const double step = kDisparitySigma * normal(random);
      if (exact.at(x, y) == 0 || cm <= 0) continue;
      const double noisy_cm = kDisparityScale_cm / std::floor(kDisparityScale_cm / cm + step + 0.5);
      frame.depth.at(x, y) =
          static_cast<uint16_t>(std::clamp(std::lround(noisy_cm * kDepthUnitsPerMetre / 100), 0l, 65535l));
    }
  for (size_t i = 0; i < frame.colour.size(); ++i) {
    Rgb& c = frame.colour.data()[i];
    c = {toByte(c.r + kColourSigma * normal(random)), toByte(c.g + kColourSigma * normal(random)),
         toByte(c.b + kColourSigma * normal(random))};
  }
}

void changeExposure(Frame& frame, double gain, double bias) {
  for (size_t i = 0; i < frame.colour.size(); ++i) {
    Rgb& c = frame.colour.data()[i];
    c = {toByte(gain * c.r + bias), toByte(gain * c.g + bias), toByte(gain * c.b + bias)};
  }
}

}  // namespace comap
