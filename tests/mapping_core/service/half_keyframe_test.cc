#include "mapping_core/service/half_keyframe.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

Keyframe plain() {
  Keyframe keyframe;
  keyframe.id = {"a", 1, 3};
  keyframe.camera = {20, 20, 9.5, 7.5, 20, 16};
  keyframe.colour = ColourImage(20, 16, Rgb{10, 20, 30});
  keyframe.depth = DepthImage(20, 16, 10000);  // 2 m
  keyframe.depth_hits = Image<uint8_t>(5, 4, 6);
  return keyframe;
}

TEST(HalfKeyframe, HalvesCameraAndPictures) {
  Keyframe keyframe = plain();
  keyframe.colour.at(5, 2) = {14, 20, 30};
  const Keyframe half = halved(keyframe);
  EXPECT_EQ(half.id, keyframe.id);
  EXPECT_EQ(half.camera, keyframe.camera.shrunk(2));
  EXPECT_EQ(half.colour.width(), 10);
  EXPECT_EQ(half.depth.height(), 8);
  EXPECT_EQ(half.colour.at(2, 1), (Rgb{11, 20, 30}));
  EXPECT_EQ(half.colour.at(3, 1), (Rgb{10, 20, 30}));
  EXPECT_EQ(half.depth.at(2, 1), 10000);
}

TEST(HalfKeyframe, EdgesStayEdges) {
  Keyframe keyframe = plain();
  keyframe.depth.at(4, 4) = 0;      // no depth
  keyframe.depth.at(5, 4) = 5000;   // another surface, a metre nearer
  keyframe.depth.at(8, 4) = 10020;  // noise
  for (int i = 0; i < 4; ++i) keyframe.depth.at(12 + i % 2, 4 + i / 2) = 0;
  const Keyframe half = halved(keyframe);
  EXPECT_EQ(half.depth.at(2, 2), 5000);
  EXPECT_EQ(half.depth.at(4, 2), 10005);
  EXPECT_EQ(half.depth.at(6, 2), 0);
}

TEST(HalfKeyframe, AgreementIsThatOfTheLeastAgreedBlock) {
  Keyframe keyframe = plain();
  keyframe.depth_hits.at(2, 1) = 3;
  const Keyframe half = halved(keyframe);
  ASSERT_EQ(half.depth_hits.width(), 3);
  ASSERT_EQ(half.depth_hits.height(), 2);
  EXPECT_EQ(half.depth_hits.at(0, 0), 6);
  EXPECT_EQ(half.depth_hits.at(1, 0), 3);
  EXPECT_EQ(half.depth_hits.at(2, 1), 6) << "the last column has one block only";
  keyframe.depth_hits = {};
  EXPECT_TRUE(halved(keyframe).depth_hits.empty());
}

}  // namespace
}  // namespace comap
