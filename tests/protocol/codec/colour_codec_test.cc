#include "protocol/codec/colour_codec.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

double meanDifference(const ColourImage& a, const ColourImage& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    sum += std::abs(a.data()[i].r - b.data()[i].r) + std::abs(a.data()[i].g - b.data()[i].g) +
           std::abs(a.data()[i].b - b.data()[i].b);
  }
  return sum / (3.0 * static_cast<double>(a.size()));
}

// Smooth, so that chroma subsampling has nothing to lose.
ColourImage gradient(int width, int height) {
  ColourImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = {static_cast<uint8_t>(255 * x / width), static_cast<uint8_t>(255 * y / height), 90};
    }
  }
  return image;
}

TEST(ColourCodec, ComesBackAlike) {
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(16, 16), std::pair(17, 33), std::pair(101, 51)}) {
    const ColourImage image = gradient(width, height);
    const auto bytes = encodeColour(image);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeColour(*bytes, width, height);
    ASSERT_TRUE(back) << back.error().text;
    ASSERT_EQ(back->width(), width);
    EXPECT_LT(meanDifference(*back, image), width > 100 ? 1.5 : 4.0);
  }
}

TEST(ColourCodec, EncodesTheSameTwice) {
  samples::Random random(1);
  const Keyframe keyframe = samples::keyframe(random, 160, 120);
  EXPECT_EQ(*encodeColour(keyframe.colour), *encodeColour(keyframe.colour));
}

TEST(ColourCodec, RefusesAnotherSize) {
  const auto bytes = encodeColour(gradient(64, 48));
  ASSERT_TRUE(bytes);
  const auto back = decodeColour(*bytes, 64, 64);
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().code, ErrorCode::kBadData);
  EXPECT_THAT(back.error().text, HasSubstr("JPEG of 64x48 pixels, expected 64x64"));
  EXPECT_FALSE(decodeColour(*bytes, 8192, 8192));
}

TEST(ColourCodec, RefusesSidesAndQualitiesBeyondTheLimits) {
  EXPECT_FALSE(encodeColour(gradient(15, 100)));
  EXPECT_FALSE(encodeColour(gradient(4097, 16)));
  EXPECT_FALSE(encodeColour(ColourImage()));
  EXPECT_FALSE(encodeColour(gradient(64, 48), 0));
  EXPECT_FALSE(encodeColour(gradient(64, 48), 101));
}

TEST(ColourCodec, RefusesEveryPrefixAndSurvivesTheRest) {
  samples::Random random(3);
  const auto bytes = encodeColour(samples::keyframe(random, 64, 48).colour);
  ASSERT_TRUE(bytes);
  // The last two bytes are the end mark, which a decoder that has all its pixels may not look for.
  for (size_t length = 0; length + 2 < bytes->size(); ++length) {
    const std::vector<uint8_t> prefix(bytes->begin(), bytes->begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(decodeColour(prefix, 64, 48)) << length;
  }
  samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeColour(bad, 64, 48)); });
}

}  // namespace
}  // namespace comap
