#include "mapping_core/ferns/fern_encoder.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "mapping_core/ferns/place_index.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

double shareOfBitsChanged(const FernCode& a, const FernCode& b) {
  size_t bits = 0, changed = 0;
  for (size_t i = 0; i < a.codes.size(); ++i) {
    if (a.codes[i] == FernCode::kBad || b.codes[i] == FernCode::kBad) continue;
    bits += 4;
    changed += static_cast<size_t>(std::popcount(static_cast<unsigned>(a.codes[i] ^ b.codes[i])));
  }
  return static_cast<double>(changed) / static_cast<double>(bits);
}

FernCode encode(const Frame& frame) { return encodeFerns(FernBook::standard(), frame.colour, frame.depth); }

TEST(FernEncoder, twoBooksOfOneSeedGiveOneCode) {
  const Frame frame = Scene::room().render(kinectCamera(), Pose());
  const FernCode a = encodeFerns(FernBook(5, 500, 400, 5000), frame.colour, frame.depth);
  const FernCode b = encodeFerns(FernBook(5, 500, 400, 5000), frame.colour, frame.depth);
  EXPECT_EQ(a, b);
  EXPECT_EQ(a.codes.size(), 500u);
  EXPECT_EQ(a.book_hash, FernBook(5, 500, 400, 5000).hash());
  EXPECT_NE(a, encodeFerns(FernBook(6, 500, 400, 5000), frame.colour, frame.depth));
}

TEST(FernEncoder, codesAreBitsAboveThresholds) {
  const FernBook book(5, 200, 400, 5000);
  // One colour of mean grey 110 keeps its values through the normalisation; depth 2.5 m.
  const ColourImage colour(160, 120, Rgb{110, 110, 110});
  const FernCode code = encodeFerns(book, colour, DepthImage(160, 120, 12500));
  for (size_t i = 0; i < 200; ++i) {
    const Fern& fern = book.ferns()[i];
    if (std::abs(fern.r - 110) < 2 || std::abs(fern.g - 110) < 2 || std::abs(fern.b - 110) < 2) continue;
    const int expected = (110 > fern.r) | (110 > fern.g) << 1 | (110 > fern.b) << 2 | (2500 > fern.depth_mm) << 3;
    EXPECT_EQ(code.codes[i], expected) << "fern " << i;
  }
}

TEST(FernEncoder, withoutDepthAFernIsBad) {
  const FernBook book = FernBook::standard();
  DepthImage depth(320, 240, 10000);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 160; ++x) depth.at(x, y) = 0;
  const FernCode code = encodeFerns(book, ColourImage(320, 240, Rgb{90, 90, 90}), depth);
  for (size_t i = 0; i < code.codes.size(); ++i)
    EXPECT_EQ(code.codes[i] == FernCode::kBad, book.ferns()[i].x < kFernImageWidth / 2) << "fern " << i;
}

TEST(FernEncoder, exposureChangesFewBits) {
  for (const double yaw : {0.0, 1.5, 3.0, 4.5}) {
    const Pose pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())), {0, 0, 0});
    const Frame frame = Scene::room().render(kinectCamera(), pose);
    Frame bright = frame, dark = frame;
    changeExposure(bright, 1.3, 0);
    changeExposure(dark, 1 / 1.3, 0);
    EXPECT_LT(shareOfBitsChanged(encode(frame), encode(bright)), 0.05) << "yaw " << yaw;
    EXPECT_LT(shareOfBitsChanged(encode(frame), encode(dark)), 0.05) << "yaw " << yaw;
  }
}

TEST(FernEncoder, imageSizeHardlyMatters) {
  const Frame large = Scene::room().render(kinectCamera(), Pose());
  const Frame small = Scene::room().render(smallCamera(), Pose());
  EXPECT_LT(shareOfBitsChanged(encode(large), encode(small)), 0.02);
}

TEST(FernEncoder, imagesSmallerThanTheFernsAndBlackOnesAreEncoded) {
  const FernCode tiny = encodeFerns(FernBook::standard(), ColourImage(8, 6), DepthImage(8, 6, 10000));
  EXPECT_EQ(tiny.codes.size(), 500u);
  for (const uint8_t code : tiny.codes) EXPECT_LT(code, 16);
}

}  // namespace
}  // namespace comap
