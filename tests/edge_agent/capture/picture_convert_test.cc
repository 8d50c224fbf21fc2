#include "edge_agent/capture/picture_convert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "edge_agent/capture/image_codec.h"

namespace comap {
namespace {

constexpr int kWidth = 46, kHeight = 26;

std::vector<uint8_t> randomBytes(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<uint8_t> bytes(count);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

Picture picture(PixelFormat format, int stride, size_t rows, uint32_t seed = 1) {
  Picture made;
  made.format = format;
  made.width = kWidth;
  made.height = kHeight;
  made.stride_bytes = stride;
  made.bytes = randomBytes(static_cast<size_t>(stride) * rows, seed);
  return made;
}

// BT.601 in real arithmetic.
std::array<double, 3> reference(int y, int u, int v, bool full) {
  const double l = full ? y : (y - 16) * 255.0 / 219, s = full ? 1.0 : 255.0 / 224;
  const double b = s * (u - 128), r = s * (v - 128);
  return {l + 1.402 * r, l - 0.344136 * b - 0.714136 * r, l + 1.772 * b};
}

void expectNear(const Rgb& found, const std::array<double, 3>& wanted) {
  const uint8_t channels[] = {found.r, found.g, found.b};
  for (size_t i = 0; i < 3; ++i) ASSERT_LE(std::abs(channels[i] - std::clamp(wanted[i], 0.0, 255.0)), 1.0);
}

TEST(PictureConvert, YuyvIsWithinOneOfRealArithmetic) {
  for (const bool full : {false, true}) {
    Picture in = picture(PixelFormat::kYuyv, kWidth * 2 + 6, kHeight);
    in.full_range = full;
    const auto out = toColour(in);
    ASSERT_TRUE(out) << out.error().text;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const uint8_t* row = in.bytes.data() + y * in.stride_bytes;
        const uint8_t* group = row + x / 2 * 4;
        expectNear(out->at(x, y), reference(row[2 * x], group[1], group[3], full));
      }
    }
  }
}

TEST(PictureConvert, Nv12IsWithinOneOfRealArithmetic) {
  for (const bool full : {false, true}) {
    Picture in = picture(PixelFormat::kNv12, kWidth + 18, kHeight + kHeight / 2);
    in.full_range = full;
    const auto out = toColour(in);
    ASSERT_TRUE(out) << out.error().text;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const uint8_t* uv = in.bytes.data() + (kHeight + y / 2) * in.stride_bytes + x / 2 * 2;
        expectNear(out->at(x, y),
                   reference(in.bytes[static_cast<size_t>(y * in.stride_bytes + x)], uv[0], uv[1], full));
      }
    }
  }
}

TEST(PictureConvert, RgbIsExact) {
  Picture in = picture(PixelFormat::kRgb3, kWidth * 3 + 2, kHeight);
  const auto rgb = toColour(in);
  in.format = PixelFormat::kBgr3;
  const auto bgr = toColour(in);
  ASSERT_TRUE(rgb && bgr);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const uint8_t* at = in.bytes.data() + y * in.stride_bytes + 3 * x;
      ASSERT_EQ(rgb->at(x, y), (Rgb{at[0], at[1], at[2]}));
      ASSERT_EQ(bgr->at(x, y), (Rgb{at[2], at[1], at[0]}));
    }
  }
}

TEST(PictureConvert, DepthIsExact) {
  for (const PixelFormat format : {PixelFormat::kZ16, PixelFormat::kY16, PixelFormat::kInzi}) {
    const int planes = format == PixelFormat::kInzi ? 2 : 1;
    const Picture in = picture(format, kWidth * 2 + 4, static_cast<size_t>(kHeight * planes));
    const auto out = toDepthValues(in);
    ASSERT_TRUE(out) << out.error().text;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const uint8_t* at = in.bytes.data() + ((planes - 1) * kHeight + y) * in.stride_bytes + 2 * x;
        ASSERT_EQ(out->at(x, y), at[0] + 256 * at[1]);
      }
    }
  }
}

TEST(PictureConvert, ShortAndOddPicturesAreRefused) {
  for (const PixelFormat format : {PixelFormat::kYuyv, PixelFormat::kNv12, PixelFormat::kRgb3, PixelFormat::kZ16,
                                   PixelFormat::kInzi, PixelFormat::kY16, PixelFormat::kMjpeg}) {
    const bool depth = format >= PixelFormat::kZ16;
    const auto code = [&](const Picture& in) {
      return depth ? toDepthValues(in).error().code : toColour(in).error().code;
    };
    Picture in = picture(format, kWidth * 3, kHeight * 2);
    in.bytes.resize(static_cast<size_t>(kWidth * kHeight / 2));
    EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
    in.bytes.clear();
    EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
    if (format != PixelFormat::kMjpeg) {
      in = picture(format, kWidth * 3, kHeight * 2);
      in.stride_bytes = 1;
      EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
      in.stride_bytes = -1;
      EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
      in.stride_bytes = kWidth * 3;
      in.height = 0;
      EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
      in.height = -5;
      EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
      in.height = 1 << 30;
      EXPECT_EQ(code(in), ErrorCode::kBadData) << toString(format);
    }
    in = picture(format, kWidth * 3, kHeight * 2);
    EXPECT_EQ(depth ? toColour(in).error().code : toDepthValues(in).error().code, ErrorCode::kWrongUse);
  }
  Picture odd = picture(PixelFormat::kYuyv, kWidth * 2, kHeight);
  --odd.width;
  EXPECT_EQ(toColour(odd).error().code, ErrorCode::kBadData);
}

ColourImage texture() {
  ColourImage image(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      image.at(x, y) = {static_cast<uint8_t>(4 * x), static_cast<uint8_t>(5 * y),
                        static_cast<uint8_t>(128 + 60 * std::sin(0.3 * x * y))};
  return image;
}

Picture jpegOf(const ColourImage& image) {
  Picture in;
  in.format = PixelFormat::kMjpeg;
  in.width = image.width();
  in.height = image.height();
  in.bytes = codec_detail::encodeJpeg(image, 85, "test").value();
  return in;
}

// Cuts out all segments of one kind.
std::vector<uint8_t> without(const std::vector<uint8_t>& jpeg, uint8_t marker) {
  std::vector<uint8_t> left(jpeg.begin(), jpeg.begin() + 2);
  size_t at = 2;
  while (jpeg[at + 1] != 0xda) {
    const size_t length = 2 + static_cast<size_t>(jpeg[at + 2] << 8 | jpeg[at + 3]);
    if (jpeg[at + 1] != marker) left.insert(left.end(), jpeg.begin() + at, jpeg.begin() + at + length);
    at += length;
  }
  left.insert(left.end(), jpeg.begin() + at, jpeg.end());
  return left;
}

TEST(PictureConvert, MjpegWithAndWithoutTablesIsTheSamePicture) {
  Picture in = jpegOf(texture());
  const auto whole = toColour(in);
  ASSERT_TRUE(whole) << whole.error().text;
  const size_t size = in.bytes.size();
  in.bytes = without(in.bytes, 0xc4);
  ASSERT_LT(in.bytes.size(), size);
  const auto bare = toColour(in);
  ASSERT_TRUE(bare) << bare.error().text;
  EXPECT_EQ(*bare, *whole);
  in.width = 32;
  EXPECT_EQ(toColour(in).error().code, ErrorCode::kBadData) << "of another size than the stream's";
}

TEST(PictureConvert, DamagedMjpegIsAnErrorOrAPicture) {
  const Picture whole = jpegOf(texture());
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    Picture in = whole;
    const bool cut = i % 3 == 0;
    if (cut) in.bytes.resize(random() % in.bytes.size());
    for (auto flips = cut ? 0 : 1 + random() % 20; flips > 0 && !in.bytes.empty(); --flips)
      in.bytes[random() % in.bytes.size()] ^= static_cast<uint8_t>(1u << random() % 8);
    const auto out = toColour(in);
    if (!out) {
      ++refused;
      ASSERT_EQ(out.error().code, ErrorCode::kBadData) << out.error().text;
      continue;
    }
    ASSERT_EQ(out->width(), 64);
    ASSERT_EQ(out->height(), 48);
    ASSERT_FALSE(cut && in.bytes.size() + 2 < whole.bytes.size()) << "a truncated picture is no picture";
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace comap
