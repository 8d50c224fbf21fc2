#include <gtest/gtest.h>

#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/source_uri.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

// Frames as the data set has them: 640x480, the first row red, depth of the frame's number in decimetres.
void shoot(const TemporaryFolder& folder, int first, int last) {
  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  ColourImage colour(640, 480);
  for (int x = 0; x < 640; ++x) colour.at(x, 0) = {255, 0, 0};
  for (int i = first; i < last; ++i) {
    const std::string name = std::string("/").append(std::to_string(i)).append(".png");
    ASSERT_TRUE(writeColourPng(folder / "rgb" + name, colour));
    ASSERT_TRUE(writeDepth16Png(folder / "depth" + name, DepthImage(640, 480, static_cast<uint16_t>(500 * (i + 1)))));
  }
}

void expectFrame(FrameSource& source, int number) {
  const auto next = source.next();
  ASSERT_TRUE(next && *next) << (next ? "" : next.error().text);
  EXPECT_EQ((*next)->stamp_ns, number * int64_t{1'000'000'000});
  EXPECT_EQ((*next)->depth.at(5, 5), 500 * (number + 1));
  EXPECT_EQ((*next)->colour.at(0, 479), (Rgb{255, 0, 0})) << "y points up: rows are reversed";
  EXPECT_EQ((*next)->camera, (CameraModel{481.2, 480.0, 319.5, 239.5, 640, 480}));
}

TEST(IclSource, ReadsTheListThatNamesDepthFirst) {
  TemporaryFolder folder;
  shoot(folder, 0, 2);
  folder.write("associations.txt", "0 depth/0.png 0 rgb/0.png\n1 depth/1.png 1 rgb/1.png\n");
  auto source = openSource("icl:" + folder.path());
  ASSERT_TRUE(source) << source.error().text;
  EXPECT_EQ((*source)->size(), 2u);
  expectFrame(**source, 0);
  expectFrame(**source, 1);
}

TEST(IclSource, NumbersItselfWithoutAList) {
  TemporaryFolder folder;
  shoot(folder, 8, 12);
  std::filesystem::remove(folder / "depth/9.png");
  auto source = openSource("icl:" + folder.path() + "@0:3");
  ASSERT_TRUE(source) << source.error().text;
  expectFrame(**source, 8);
  expectFrame(**source, 10);
  expectFrame(**source, 11);
  EXPECT_FALSE(*(*source)->next());
}

TEST(IclSource, ACalibrationInTheFolderGoesFirst) {
  TemporaryFolder folder;
  shoot(folder, 0, 1);
  folder.write("calibration.txt", "481.2 480 319.5 239.5 640 480 5000\n");
  auto source = openSource("icl:" + folder.path());
  ASSERT_TRUE(source) << source.error().text;
  const auto next = (*source)->next();
  ASSERT_TRUE(next && *next);
  EXPECT_EQ((*next)->colour.at(0, 0), (Rgb{255, 0, 0})) << "y points down: rows stay";
}

TEST(IclSource, WhatIsNoneIsRefused) {
  TemporaryFolder folder;
  EXPECT_EQ(openSource("icl:" + folder.path()).error().code, ErrorCode::kBadData);
  EXPECT_EQ(openSource("icl:/no/such/folder").error().code, ErrorCode::kUnreachable);
}

}  // namespace
}  // namespace comap
