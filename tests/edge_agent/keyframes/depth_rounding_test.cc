#include "edge_agent/keyframes/depth_rounding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace comap {
namespace {

TEST(DepthRounding, staysWithinItsPromise) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> depth(0.3f, 8);
  Image<float> exact(64, 48);
  for (size_t i = 0; i < exact.size(); ++i) exact.data()[i] = i % 7 == 0 ? 0 : depth(random);
  const DepthRounding rounding;
  const DepthImage rounded = roundDepth(exact, rounding);
  for (size_t i = 0; i < exact.size(); ++i) {
    if (exact.data()[i] == 0) {
      EXPECT_EQ(rounded.data()[i], 0);
      continue;
    }
    const double z = rounded.data()[i] / kDepthUnitsPerMetre;
    const double most = (rounding.tolerance + 0.5) * rounding.step_per_m;
    EXPECT_NEAR(1 / z, 1 / exact.data()[i], most + 1e-4 / (z * z)) << "and half a unit of depth";
  }
}

TEST(DepthRounding, aPlaneUnderNoiseBecomesFewValues) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.0004f);  // of inverse depth, as an averaged sensor has
  Image<float> exact(64, 48);
  for (size_t i = 0; i < exact.size(); ++i) exact.data()[i] = 1 / (0.5f + noise(random));
  const DepthImage rounded = roundDepth(exact, {});
  std::vector<int> seen(65536, 0);
  int values = 0;
  for (size_t i = 0; i < rounded.size(); ++i) values += seen[rounded.data()[i]]++ == 0;
  EXPECT_LE(values, 4);
}

TEST(DepthRounding, whatIsNoDepthBecomesNone) {
  Image<float> exact(4, 1);
  exact.data()[0] = std::numeric_limits<float>::quiet_NaN();
  exact.data()[1] = -1;
  exact.data()[2] = 14;
  exact.data()[3] = std::numeric_limits<float>::infinity();
  const DepthImage rounded = roundDepth(exact, {});
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(rounded.data()[i], 0) << i;
}

TEST(DepthRounding, theFewestHitsOfABlockCount) {
  Image<uint8_t> hits(5, 4, 9);
  hits.at(1, 1) = 3;
  hits.at(2, 2) = 0;  // no depth there
  hits.at(4, 3) = 0;
  const Image<uint8_t> blocks = fewestOfBlocks(hits, 4);
  ASSERT_EQ(blocks.width(), 2);
  ASSERT_EQ(blocks.height(), 1);
  EXPECT_EQ(blocks.at(0, 0), 3);
  EXPECT_EQ(blocks.at(1, 0), 9);
  EXPECT_EQ(fewestOfBlocks(Image<uint8_t>(4, 4, 0), 4).at(0, 0), 0);
}

}  // namespace
}  // namespace comap
