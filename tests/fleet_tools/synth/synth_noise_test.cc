#include "fleet_tools/synth/synth_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fleet_tools/synth/synth_random.h"

namespace comap {
namespace {

SynthView wallAt(float depth_m, float cosine = 1) {
  return {ColourImage(200, 100, Rgb{100, 100, 100}), Image<float>(200, 100, depth_m), Image<float>(200, 100, cosine),
          Image<int32_t>(200, 100, 0)};
}

TEST(SynthNoise, ExactDepthIsExactToItsUnit) {
  EXPECT_EQ(exactDepth(wallAt(2.34561f), 1).at(5, 5), 11728);
  EXPECT_EQ(exactDepth(wallAt(0), 1).at(5, 5), 0);
  EXPECT_EQ(exactDepth(wallAt(13.2f), 1).at(5, 5), 0) << "beyond what 16 bits hold";
}

TEST(SynthNoise, DepthStepsGrowWithTheSquareAndTheMeanStays) {
  for (const float depth_m : {0.8f, 1.55f, 2.9f, 4.1f}) {
    const auto noisy = kinectDepth(wallAt(depth_m), 7, 2);
    const double step_m = depth_m * depth_m / 351.3;
    double sum = 0, squares = 0;
    for (size_t i = 0; i < noisy.size(); ++i) {
      const double error = noisy.data()[i] / kDepthUnitsPerMetre - static_cast<double>(depth_m);
      EXPECT_LT(std::abs(error), 1.6 * step_m + 2e-4);
      sum += error;
      squares += error * error;
    }
    const auto n = static_cast<double>(noisy.size());
    EXPECT_LT(std::abs(sum / n), 0.55 * step_m) << "floor, not the half-step bias of rounding after adding a half";
    EXPECT_GT(std::sqrt(squares / n), 0.02 * step_m);
    EXPECT_LT(std::sqrt(squares / n), 0.7 * step_m);
  }
}

TEST(SynthNoise, RangeAndIncidence) {
  const auto none = [](const SynthView& view) {
    const auto depth = kinectDepth(view, 1, 1);
    size_t count = 0;
    for (size_t i = 0; i < depth.size(); ++i) count += depth.data()[i] == 0 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(none(wallAt(0.39f)), 20000u);
  EXPECT_EQ(none(wallAt(0.45f)), 0u);
  EXPECT_EQ(none(wallAt(4.45f)), 0u);
  EXPECT_EQ(none(wallAt(4.55f)), 20000u);
  EXPECT_EQ(none(wallAt(2, static_cast<float>(std::cos(81 / 57.29578)))), 0u);
  EXPECT_EQ(none(wallAt(2, static_cast<float>(std::cos(83 / 57.29578)))), 20000u);
}

TEST(SynthNoise, NothingAtDepthEdges) {
  auto view = wallAt(1.5f);
  for (int y = 0; y < 100; ++y) {
    for (int x = 100; x < 200; ++x) view.depth_m.at(x, y) = 2.5f;
  }
  const auto depth = kinectDepth(view, 3, 1);
  int dropped = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 200; ++x) {
      const double z = depth.at(x, y) / kDepthUnitsPerMetre;
      if (depth.at(x, y) == 0) {
        ++dropped;
        EXPECT_LT(std::abs(x - 99.5), 4);
      } else {
        EXPECT_LT(std::min(std::abs(z - 1.5), std::abs(z - 2.5)), 0.04) << "no flying pixels";
      }
    }
  }
  EXPECT_GT(dropped, 50);
}

TEST(SynthNoise, IsAFunctionOfTheKeyOnly) {
  EXPECT_EQ(kinectDepth(wallAt(3), 5, 1), kinectDepth(wallAt(3), 5, 4));
  EXPECT_NE(kinectDepth(wallAt(3), 5, 1), kinectDepth(wallAt(3), 6, 1));
  auto a = wallAt(1).colour, b = a, c = a;
  addColourNoise(a, 5, 1);
  addColourNoise(b, 5, 4);
  addColourNoise(c, 6, 1);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, c);
}

TEST(SynthNoise, NormalTableHasUnitVarianceAndNoMean) {
  double sum = 0, squares = 0;
  for (uint64_t i = 0; i < kNormalEntries; ++i) {
    const double x = normalTable()[i];
    sum += x;
    squares += x * x;
  }
  const auto n = static_cast<double>(kNormalEntries);
  EXPECT_NEAR(sum / n, 0, 1e-4);
  EXPECT_NEAR(squares / n, 1, 1e-3);
  EXPECT_NEAR(normalTable()[static_cast<uint64_t>(0.8413447 * n)], 1, 1e-3);
}

}  // namespace
}  // namespace comap
