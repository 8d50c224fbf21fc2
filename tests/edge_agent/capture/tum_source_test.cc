#include "edge_agent/capture/tum_source.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "edge_agent/capture/image_file.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

constexpr int kWidth = 8, kHeight = 6;

// Three frames; colour and depth tell the frame and the row.
class TumSourceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("calibration.txt", "# fx fy cx cy width height depth_scale\n5 6 3.5 2 8 6 1000\n");
    folder_.write("associations.txt",
                  "# a comment\n"
                  "10.000000001 rgb/0.png 10.001 depth/0.png\n"
                  "10.033333 rgb/1.png 10.034 depth/1.png\n\n"
                  "10.066667 rgb/2.png 10.067 depth/2.png\n");
    std::filesystem::create_directory(folder_ / "rgb");
    std::filesystem::create_directory(folder_ / "depth");
    for (int i = 0; i < 3; ++i) {
      ColourImage colour(kWidth, kHeight);
      DepthImage depth(kWidth, kHeight);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          colour.at(x, y) = {static_cast<uint8_t>(i), static_cast<uint8_t>(y), static_cast<uint8_t>(x)};
          depth.at(x, y) = static_cast<uint16_t>(1000 + 10 * i + y);
        }
      }
      depth.at(0, 0) = 0;
      depth.at(1, 0) = 13107;  // * 5 = 65535, the largest that fits
      depth.at(2, 0) = 13108;
      ASSERT_TRUE(writeColourPng(folder_ / ("rgb/" + std::to_string(i) + ".png"), colour));
      ASSERT_TRUE(writeDepth16Png(folder_ / ("depth/" + std::to_string(i) + ".png"), depth));
    }
  }

  Frame frame(size_t index) {
    auto source = openTum(folder_.path(), {index, index + 1});
    EXPECT_TRUE(source) << source.error().text;
    auto result = (*source)->next();
    EXPECT_TRUE(result) << result.error().text;
    return **result;
  }

  void expectRefused(ErrorCode code, std::initializer_list<std::string> words, TumRange range = {}) {
    auto source = openTum(folder_.path(), range);
    std::optional<Error> error;
    if (!source) error = source.error();
    while (!error) {
      auto result = (*source)->next();
      if (!result) error = result.error();
      if (result && !*result) break;
    }
    ASSERT_TRUE(error) << "nothing was refused";
    EXPECT_EQ(error->code, code) << error->text;
    for (const auto& word : words) EXPECT_NE(error->text.find(word), std::string::npos) << error->text;
  }

  TemporaryFolder folder_;
};

TEST_F(TumSourceTest, GivesFramesInOrderThenEnds) {
  auto source = openTum(folder_.path());
  ASSERT_TRUE(source) << source.error().text;
  EXPECT_EQ((*source)->size(), 3u);
  const int64_t stamps[] = {10000000001, 10033333000, 10066667000};
  for (int i = 0; i < 3; ++i) {
    auto next = (*source)->next();
    ASSERT_TRUE(next) << next.error().text;
    ASSERT_TRUE(next->has_value());
    EXPECT_EQ((*next)->stamp_ns, stamps[i]);
    EXPECT_EQ((*next)->colour.at(3, 4), (Rgb{static_cast<uint8_t>(i), 4, 3}));
    EXPECT_EQ((*next)->camera, (CameraModel{5, 6, 3.5, 2, 8, 6}));
  }
  for (int again = 0; again < 2; ++again) {
    auto end = (*source)->next();
    ASSERT_TRUE(end);
    EXPECT_FALSE(end->has_value());
  }
}

TEST_F(TumSourceTest, DepthOfScale1000IsExactAndOutOfRangeBecomesZero) {
  const auto depth = frame(1).depth;
  EXPECT_EQ(depth.at(4, 3), 1013 * 5);
  EXPECT_EQ(depth.at(0, 0), 0);
  EXPECT_EQ(depth.at(1, 0), 65535);
  EXPECT_EQ(depth.at(2, 0), 0);
}

TEST_F(TumSourceTest, OtherScales) {
  folder_.write("calibration.txt", "5 6 3.5 2 8 6 5000\n");
  EXPECT_EQ(frame(0).depth.at(4, 3), 1003);
  folder_.write("calibration.txt", "5 6 3.5 2 8 6 5208\n");
  EXPECT_EQ(frame(0).depth.at(4, 3), 963);  // 1003 * 5000 / 5208 = 962.94
}

TEST_F(TumSourceTest, RangeIsFirstInclusiveLastExclusive) {
  auto source = openTum(folder_.path(), {1, 3});
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->size(), 2u);
  EXPECT_EQ((*(*source)->next())->stamp_ns, 10033333000);
  expectRefused(ErrorCode::kWrongUse, {"frames 0:200 asked, the sequence has 3"}, {0, 200});
  expectRefused(ErrorCode::kWrongUse, {"frames 2:2 asked"}, {2, 2});
  expectRefused(ErrorCode::kWrongUse, {"frames 3:3 asked"}, {3, TumRange::kToEnd});
}

TEST_F(TumSourceTest, UpwardCameraIsServedWithReversedRows) {
  const auto before = frame(2);
  folder_.write("calibration.txt", "5 -6 3.5 2 8 6 1000\n");
  const auto after = frame(2);
  EXPECT_EQ(after.camera, (CameraModel{5, 6, 3.5, 3, 8, 6}));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(after.colour.at(x, kHeight - 1 - y), before.colour.at(x, y));
      EXPECT_EQ(after.depth.at(x, kHeight - 1 - y), before.depth.at(x, y));
      // The same point in the camera frame, whichever way it is read: the truth's poses hold for both.
      const double y_up = (y - 2) / -6.0;
      EXPECT_NEAR(after.camera.unproject(x, kHeight - 1 - y, 1.0).y(), y_up, 1e-12);
    }
  }
}

TEST_F(TumSourceTest, PairsByNearestTimeWithoutAssociations) {
  std::filesystem::remove(folder_ / "associations.txt");
  // rgb 1 is nearer to depth 0 (5 ms) than rgb 0 (15 ms); rgb 0 then has depth at 19 ms only if free; rgb 2 has none.
  folder_.write("rgb.txt", "1.020 rgb/1.png\n1.000 rgb/0.png\n2.000 rgb/2.png\n");
  folder_.write("depth.txt", "# t f\n1.015 depth/0.png\n0.981 depth/1.png\n2.0200001 depth/2.png\n");
  auto source = openTum(folder_.path());
  ASSERT_TRUE(source) << source.error().text;
  ASSERT_EQ((*source)->size(), 2u);
  auto first = *(*source)->next();
  EXPECT_EQ(first->stamp_ns, 1000000000);
  EXPECT_EQ(first->colour.at(0, 0).r, 0);
  EXPECT_EQ(first->depth.at(4, 3), 1013 * 5);
  auto second = *(*source)->next();
  EXPECT_EQ(second->stamp_ns, 1020000000);
  EXPECT_EQ(second->colour.at(0, 0).r, 1);
  EXPECT_EQ(second->depth.at(4, 3), 1003 * 5);
}

TEST_F(TumSourceTest, AllZeroDepthPasses) {
  ASSERT_TRUE(writeDepth16Png(folder_ / "depth/1.png", DepthImage(kWidth, kHeight)));
  EXPECT_EQ(frame(1).depth, DepthImage(kWidth, kHeight));
}

TEST_F(TumSourceTest, MissingThings) {
  EXPECT_EQ(openTum(folder_ / "none").error().code, ErrorCode::kUnreachable);
  std::filesystem::remove(folder_ / "depth/1.png");
  expectRefused(ErrorCode::kUnreachable, {"depth/1.png"});
  std::filesystem::remove(folder_ / "associations.txt");
  expectRefused(ErrorCode::kUnreachable, {"rgb.txt"});
  std::filesystem::remove(folder_ / "calibration.txt");
  expectRefused(ErrorCode::kUnreachable, {"calibration.txt"});
}

TEST_F(TumSourceTest, BadPicturesNameFileFoundAndExpected) {
  ASSERT_TRUE(writeColourPng(folder_ / "rgb/1.png", ColourImage(4, 3)));
  expectRefused(ErrorCode::kBadData, {"rgb/1.png", "4x3", "8x6"});
  SetUp();
  ASSERT_TRUE(writeDepth16Png(folder_ / "depth/2.png", DepthImage(6, 8)));
  expectRefused(ErrorCode::kBadData, {"depth/2.png", "6x8", "8x6"});
  SetUp();
  ASSERT_TRUE(writeColourPng(folder_ / "depth/0.png", ColourImage(kWidth, kHeight)));
  expectRefused(ErrorCode::kBadData, {"depth/0.png", "8-bit", "16-bit"});
  SetUp();
  const std::string whole = folder_.read("rgb/0.png");
  folder_.write("rgb/0.png", whole.substr(0, whole.size() / 2));
  expectRefused(ErrorCode::kBadData, {"rgb/0.png", "truncated"});
}

TEST_F(TumSourceTest, GoesOnAfterADamagedPicture) {
  folder_.write("rgb/1.png", "rubbish");
  auto source = openTum(folder_.path());
  ASSERT_TRUE(source);
  EXPECT_TRUE((*source)->next());
  EXPECT_FALSE((*source)->next());
  auto third = (*source)->next();
  ASSERT_TRUE(third);
  EXPECT_EQ((*third)->stamp_ns, 10066667000);
}

TEST_F(TumSourceTest, BadCalibrationNamesTheValue) {
  const std::pair<const char*, const char*> cases[] = {{"0 6 3.5 2 8 6 1000\n", "fx is 0"},
                                                       {"-5 6 3.5 2 8 6 1000\n", "fx is -5"},
                                                       {"5 0 3.5 2 8 6 1000\n", "fy is 0"},
                                                       {"5 6 x 2 8 6 1000\n", "cx is 'x'"},
                                                       {"5 6 nan 2 8 6 1000\n", "cx is 'nan'"},
                                                       {"5 6 9999 2 8 6 1000\n", "cx is 9999, expected"},
                                                       {"5 6 3.5 -7 8 6 1000\n", "cy is -7, expected"},
                                                       {"5 6 3.5 2 8.5 6 1000\n", "width is 8.5"},
                                                       {"5 6 3.5 2 8 100000 1000\n", "height is"},
                                                       {"5 6 3.5 2 8 6 0\n", "depth_scale is 0"},
                                                       {"5 6 3.5 2 8 6\n", "6 numbers"},
                                                       {"5 6 3.5 2 8 6 1 2\n", "8 numbers"},
                                                       {"# nothing\n", "0 lines"},
                                                       {"5 6 3 2 8 6 1\n5 6 3 2 8 6 1\n", "2 lines"}};
  for (const auto& [text, word] : cases) {
    folder_.write("calibration.txt", text);
    expectRefused(ErrorCode::kBadData, {"calibration.txt", word});
  }
}

TEST_F(TumSourceTest, BadListsNameTheLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"1.0 rgb/0.png 1.0\n", "associations.txt:1: has 3 words"},
      {"# c\n1.x rgb/0.png 1.0 depth/0.png\n", "associations.txt:2: stamp '1.x'"},
      {"2.0 rgb/0.png 2.0 depth/0.png\n2.0 rgb/1.png 2.0 depth/1.png\n",
       "associations.txt:2: stamp '2.0' is not later"},
      {"1.0 /etc/passwd 1.0 depth/0.png\n", "leads out of"},
      {"1.0 rgb/../../secret.png 1.0 depth/0.png\n", "leads out of"},
      {"", "lists no pair"}};
  for (const auto& [text, word] : cases) {
    folder_.write("associations.txt", text);
    expectRefused(ErrorCode::kBadData, {word});
  }
}

TEST(TumSourceOnRealData, ReadsEverySequence) {
  const char* root = std::getenv("COMAP_DATA_DIR");
  if (root == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set: the recorded sequences are not here";
  const std::pair<const char*, size_t> sequences[] = {
      {"kitchen_dev", 400}, {"icl_kt0_dev", 200}, {"house_dev/a", 407}, {"house_dev/c", 368}};
  for (const auto& [name, count] : sequences) {
    auto source = openTum(std::string(root) + "/" + name);
    ASSERT_TRUE(source) << source.error().text;
    EXPECT_EQ((*source)->size(), count) << name;
    auto frame = (*source)->next();
    ASSERT_TRUE(frame) << frame.error().text;
    size_t valid = 0;
    for (size_t i = 0; i < (*frame)->depth.size(); ++i) {
      const uint16_t value = (*frame)->depth.data()[i];
      if (value > 0.3 * kDepthUnitsPerMetre && value < 10 * kDepthUnitsPerMetre) ++valid;
    }
    EXPECT_GT(valid, (*frame)->depth.size() / 2) << name << ": depth should be metres indoors";
  }
}

}  // namespace
}  // namespace comap
