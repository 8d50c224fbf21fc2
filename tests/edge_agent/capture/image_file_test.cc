#include "edge_agent/capture/image_file.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

ColourImage colourPattern(int width, int height) {
  ColourImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = {static_cast<uint8_t>(x * 2), static_cast<uint8_t>(y * 3), static_cast<uint8_t>(128 + x - y)};
    }
  }
  return image;
}

DepthImage depthPattern(int width, int height) {
  DepthImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<uint16_t>(x * 811 + y * 4099);
  }
  return image;
}

TEST(ImageFile, ColourPngIsExact) {
  TemporaryFolder folder;
  const auto image = colourPattern(37, 23);
  ASSERT_TRUE(writeColourPng(folder / "c.png", image));
  auto back = readColour(folder / "c.png");
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(*back, image);
}

TEST(ImageFile, DepthPngIsExactInAllSixteenBits) {
  TemporaryFolder folder;
  const auto image = depthPattern(41, 29);
  ASSERT_TRUE(writeDepth16Png(folder / "d.png", image));
  auto back = readDepth16(folder / "d.png");
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(*back, image);
}

TEST(ImageFile, JpegIsCloseAndKeepsChannelOrder) {
  TemporaryFolder folder;
  const auto image = colourPattern(64, 48);
  ASSERT_TRUE(writeColourJpeg(folder / "c.jpg", image, 92));
  auto back = readColour(folder / "c.jpg");
  ASSERT_TRUE(back) << back.error().text;
  ASSERT_EQ(back->width(), 64);
  ASSERT_EQ(back->height(), 48);
  double sum = 0;
  for (size_t i = 0; i < image.size(); ++i) {
    const Rgb a = image.data()[i], b = back->data()[i];
    sum += std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
  }
  EXPECT_LT(sum / static_cast<double>(image.size() * 3), 3.0);
}

TEST(ImageFile, EveryTruncationIsRefusedWithTheName) {
  TemporaryFolder folder;
  ASSERT_TRUE(writeColourPng(folder / "c.png", colourPattern(64, 48)));
  ASSERT_TRUE(writeDepth16Png(folder / "d.png", depthPattern(64, 48)));
  ASSERT_TRUE(writeColourJpeg(folder / "c.jpg", colourPattern(64, 48), 92));
  for (const char* name : {"c.png", "d.png", "c.jpg"}) {
    const std::string whole = folder.read(name);
    // From the last bytes down: the end marker is missing, data is missing, the header is missing, nothing is left.
    for (size_t length : {whole.size() - 1, whole.size() - 13, whole.size() / 2, size_t{40}, size_t{3}, size_t{0}}) {
      folder.write("cut", whole.substr(0, length));
      const bool depth = name[0] == 'd';
      const std::string text = [&] {
        if (depth) {
          auto result = readDepth16(folder / "cut");
          return result ? "" : result.error().text;
        }
        auto result = readColour(folder / "cut");
        return result ? "" : result.error().text;
      }();
      // A JPEG's picture is complete without the last byte of its end marker: that one may be read.
      if (name[2] == 'j' && length + 1 == whole.size() && text.empty()) continue;
      EXPECT_NE(text.find(folder / "cut"), std::string::npos) << name << " cut to " << length;
    }
  }
}

TEST(ImageFile, DamagedBytesNeverCrash) {
  TemporaryFolder folder;
  ASSERT_TRUE(writeDepth16Png(folder / "d.png", depthPattern(16, 12)));
  ASSERT_TRUE(writeColourJpeg(folder / "c.jpg", colourPattern(16, 12), 80));
  const std::string png = folder.read("d.png"), jpeg = folder.read("c.jpg");
  int png_refused = 0;
  for (size_t i = 8; i < png.size(); ++i) {
    std::string bytes = png;
    bytes[i] = static_cast<char>(~bytes[i]);
    folder.write("bad", bytes);
    if (!readDepth16(folder / "bad")) ++png_refused;
  }
  EXPECT_EQ(png_refused, static_cast<int>(png.size()) - 8) << "each PNG chunk has a checksum";
  for (size_t i = 3; i < jpeg.size(); ++i) {
    std::string bytes = jpeg;
    bytes[i] = static_cast<char>(~bytes[i]);
    folder.write("bad", bytes);
    auto result = readColour(folder / "bad");
    if (result) {
      EXPECT_LE(result->width(), kMaxImageEdge_px);
    }
  }
}

TEST(ImageFile, DepthMustBeSixteenBitGrey) {
  TemporaryFolder folder;
  ASSERT_TRUE(writeColourPng(folder / "c.png", colourPattern(8, 8)));
  auto depth = readDepth16(folder / "c.png");
  ASSERT_FALSE(depth);
  EXPECT_EQ(depth.error().code, ErrorCode::kBadData);
  EXPECT_NE(depth.error().text.find("8-bit"), std::string::npos) << depth.error().text;
  EXPECT_NE(depth.error().text.find("16-bit grey"), std::string::npos) << depth.error().text;
}

TEST(ImageFile, SaysWhatIsMissingOrUnwritable) {
  TemporaryFolder folder;
  auto missing = readColour(folder / "nothing.png");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(readDepth16(folder.path()).error().code, ErrorCode::kUnreachable) << "a folder is no picture";
  folder.write("text.png", "P6 not a png");
  EXPECT_EQ(readColour(folder / "text.png").error().code, ErrorCode::kBadData);
  EXPECT_FALSE(writeColourPng(folder / "no/such/folder.png", colourPattern(2, 2)));
  EXPECT_FALSE(writeColourJpeg(folder / "no/such/folder.jpg", colourPattern(2, 2), 90));
  EXPECT_FALSE(writeDepth16Png(folder / "empty.png", DepthImage()));
}

}  // namespace
}  // namespace comap
