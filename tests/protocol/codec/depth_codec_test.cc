#include "protocol/codec/depth_codec.h"

#include <gmock/gmock.h>

#include <functional>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

DepthImage fill(int width, int height, const std::function<int(int, int)>& value) {
  DepthImage depth(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) depth.at(x, y) = static_cast<uint16_t>(value(x, y));
  }
  return depth;
}

void expectLossless(const DepthImage& depth) {
  const auto bytes = encodeDepth(depth);
  ASSERT_TRUE(bytes) << bytes.error().text;
  const auto back = decodeDepth(*bytes, depth.width(), depth.height());
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_TRUE(*back == depth);
}

TEST(DepthCodec, IsLosslessForImagesOfEveryKind) {
  samples::Random random(1);
  const auto any = [&](int, int) { return samples::uniform(random, 0, 65535); };
  expectLossless(fill(64, 48, [](int, int) { return 0; }));
  expectLossless(fill(64, 48, [](int, int) { return 65535; }));
  expectLossless(fill(64, 48, [](int x, int y) { return (x + y) % 2 == 0 ? 65535 : 0; }));
  expectLossless(fill(64, 48, [](int x, int y) { return (x + y) % 2 == 0 ? 65535 : 1; }));
  expectLossless(fill(17, 16, any));
  expectLossless(fill(640, 480, any));  // every level there is
  expectLossless(fill(640, 480, [](int x, int y) { return 5 * (500 + 3 * x + y); }));
  expectLossless(fill(641, 479, [&](int x, int y) {
    return x % 50 < 9 ? 0 : 4000 + 7 * x + 2 * y + samples::uniform(random, -40, 40);
  }));
  expectLossless(fill(16, 4096, any));
  expectLossless(fill(4096, 16, any));
}

TEST(DepthCodec, IsLosslessForRandomSizesAndLevels) {
  samples::Random random(2);
  for (int round = 0; round < 100; ++round) {
    const int levels = samples::uniform(random, 1, 400), step = samples::uniform(random, 1, 100);
    const int holes = samples::uniform(random, 0, 100);
    expectLossless(fill(samples::uniform(random, 16, 90), samples::uniform(random, 16, 90), [&](int, int) {
      return samples::uniform(random, 0, 99) < holes ? 0 : step * samples::uniform(random, 1, levels);
    }));
  }
}

TEST(DepthCodec, AFactorCostsNothing) {
  samples::Random random(3);
  const DepthImage one = fill(320, 240, [&](int x, int) { return 800 + x + samples::uniform(random, -2, 2); });
  DepthImage five = one;
  for (size_t i = 0; i < five.size(); ++i) five.data()[i] = static_cast<uint16_t>(5 * five.data()[i]);
  const auto small = encodeDepth(one), large = encodeDepth(five);
  ASSERT_TRUE(small && large);
  EXPECT_NEAR(static_cast<double>(large->size()), static_cast<double>(small->size()), 30);
}

TEST(DepthCodec, RefusesAnotherSizeAndSidesBeyondTheLimits) {
  const auto bytes = encodeDepth(fill(64, 48, [](int x, int) { return x; }));
  ASSERT_TRUE(bytes);
  const auto back = decodeDepth(*bytes, 48, 64);
  ASSERT_FALSE(back);
  EXPECT_THAT(back.error().text, HasSubstr("depth: 64x48 pixels, expected 48x64"));
  EXPECT_FALSE(encodeDepth(DepthImage(15, 20)));
  EXPECT_FALSE(encodeDepth(DepthImage(20, 4097)));
  EXPECT_FALSE(encodeDepth(DepthImage()));
}

TEST(DepthCodec, RefusesEveryPrefixAndATail) {
  samples::Random random(4);
  auto bytes = *encodeDepth(samples::keyframe(random, 32, 24).depth);
  for (size_t length = 0; length < bytes.size(); ++length) {
    const std::vector<uint8_t> prefix(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(decodeDepth(prefix, 32, 24)) << length;
  }
  bytes.push_back(0);
  EXPECT_FALSE(decodeDepth(bytes, 32, 24));
}

TEST(DepthCodec, SurvivesHostileBytes) {
  samples::Random random(5);
  for (int round = 0; round < 20; ++round) {
    const bool rough = round % 2 == 1;
    const DepthImage depth = fill(40, 30, [&](int x, int y) {
      return (x * y) % 7 == 0 ? 0 : rough ? samples::uniform(random, 1, 65535) : 3000 + 5 * x + 10 * y;
    });
    const auto bytes = encodeDepth(depth);
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeDepth(bad, 40, 30)); });
  }
}

TEST(DepthCodec, ASectionCannotClaimMoreThanItsImage) {
  auto bytes = *encodeDepth(fill(32, 32, [](int, int) { return 5; }));
  // The levels section's unpacked size: four bytes after the header's six.
  for (size_t i = 6; i < 10; ++i) bytes[i] = 0xff;
  const auto back = decodeDepth(bytes, 32, 32);
  ASSERT_FALSE(back);
  EXPECT_THAT(back.error().text, HasSubstr("section levels claims 4294967295 bytes"));
}

}  // namespace
}  // namespace comap
