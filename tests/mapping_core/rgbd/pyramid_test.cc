#include "mapping_core/rgbd/pyramid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr int kLevels = 4;

CameraModel flipped(CameraModel camera) {
  camera.fy = -camera.fy;
  return camera;
}

// Where the centre of a level's pixel lies in the full image.
double fullPixel(int pixel, size_t level) { return (pixel + 0.5) * (1 << level) - 0.5; }

TEST(Pyramid, sizesAndCamerasHalve) {
  Pyramid pyramid;
  const Frame frame = Scene::room().render(smallCamera(), Pose());
  buildPyramid(frame.colour, frame.depth, frame.camera, kLevels, 0.3f, 6, pyramid);
  ASSERT_EQ(pyramid.size(), static_cast<size_t>(kLevels));
  for (size_t l = 0; l < pyramid.size(); ++l) {
    EXPECT_EQ(pyramid[l].grey.width(), 320 >> l);
    EXPECT_EQ(pyramid[l].depth_m.height(), 240 >> l);
    EXPECT_EQ(pyramid[l].camera.width, 320 >> l);
    EXPECT_NEAR(pyramid[l].camera.cx, smallCamera().shrunk(1 << l).cx, 1e-12);
  }
}

// A linear ramp keeps its values exactly under 2x2 means: any half-pixel slip would show as a constant offset.
TEST(Pyramid, greyHasNoHalfPixelBias) {
  const CameraModel camera{50, 50, 31.5, 23.5, 64, 48};
  ColourImage ramp(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const uint8_t grey = static_cast<uint8_t>(2 * x + y + 10);
      ramp.at(x, y) = {grey, grey, grey};
    }
  Pyramid pyramid;
  buildPyramid(ramp, DepthImage(64, 48, 5000), camera, kLevels, 0.3f, 6, pyramid);
  for (size_t l = 0; l < pyramid.size(); ++l)
    for (int y = 0; y < pyramid[l].grey.height(); ++y)
      for (int x = 0; x < pyramid[l].grey.width(); ++x)
        ASSERT_NEAR(pyramid[l].grey.at(x, y), 2 * fullPixel(x, l) + fullPixel(y, l) + 10, 1e-4) << "level " << l;
}

// Back-projected with one level's camera and projected with the full one, a pixel lands on its block's centre.
TEST(Pyramid, slantedPlaneReprojectsWithoutBias) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, 0.3, -0.8).normalized();
  const Scene scene = Scene::plainPlane({0, 0, 2}, normal);
  for (const CameraModel& camera : {kinectCamera(), flipped(kinectCamera())}) {
    Image<float> depth(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) depth.at(x, y) = static_cast<float>(*scene.depthAt(camera, Pose(), x, y));
    Pyramid pyramid;
    buildPyramid(ColourImage(camera.width, camera.height), depth, camera, kLevels, pyramid);
    for (size_t l = 0; l < pyramid.size(); ++l) {
      const PyramidLevel& level = pyramid[l];
      Eigen::Vector2d pixel_bias = Eigen::Vector2d::Zero();
      double off_plane_m = 0, worst_off_plane_m = 0;
      for (int y = 0; y < level.depth_m.height(); ++y)
        for (int x = 0; x < level.depth_m.width(); ++x) {
          ASSERT_GT(level.depth_m.at(x, y), 0);
          const Eigen::Vector3d point = level.camera.unproject(x, y, level.depth_m.at(x, y));
          pixel_bias += camera.project(point) - Eigen::Vector2d(fullPixel(x, l), fullPixel(y, l));
          const double off = normal.dot(point - Eigen::Vector3d(0, 0, 2));
          off_plane_m += off;
          worst_off_plane_m = std::max(worst_off_plane_m, std::abs(off));
        }
      const double count = static_cast<double>(level.depth_m.size());
      EXPECT_LT((pixel_bias / count).norm(), 1e-4) << "level " << l;
      // Depth of a slanted plane is convex in the pixel, so means of it lie a little behind: 0.1 % of a coarse
      // pixel's footprint. Half a pixel of slip would be 2 mm at level 0 and 16 mm at level 3.
      const double footprint_m = 2 / level.camera.fx;
      EXPECT_LT(std::abs(off_plane_m / count), l == 0 ? 1e-6 : 0.004 * footprint_m) << "level " << l;
      EXPECT_LT(worst_off_plane_m, l == 0 ? 1e-6 : 0.03 * footprint_m) << "level " << l;
    }
  }
}

TEST(Pyramid, depthOutsideTheLimitsIsNone) {
  DepthImage depth(8, 8, 10000);
  depth.at(0, 0) = 1499;   // 0.2998 m
  depth.at(1, 0) = 1501;   // 0.3002 m
  depth.at(2, 0) = 30001;  // 6.0002 m
  depth.at(3, 0) = 29999;
  Pyramid pyramid;
  buildPyramid(ColourImage(8, 8), depth, {10, 10, 3.5, 3.5, 8, 8}, 1, 0.3f, 6, pyramid);
  EXPECT_EQ(pyramid[0].depth_m.at(0, 0), 0);
  EXPECT_NEAR(pyramid[0].depth_m.at(1, 0), 0.3002, 1e-6);
  EXPECT_EQ(pyramid[0].depth_m.at(2, 0), 0);
  EXPECT_NEAR(pyramid[0].depth_m.at(3, 0), 5.9998, 1e-5);
}

// Means over an edge would invent surfaces in the air.
TEST(Pyramid, depthEdgesStayEdges) {
  Image<float> depth(8, 8, 3.0f);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 3; ++x) depth.at(x, y) = 1.0f;
  depth.at(6, 6) = depth.at(7, 6) = depth.at(6, 7) = 0;
  depth.at(4, 6) = depth.at(5, 6) = depth.at(4, 7) = depth.at(5, 7) = 0;
  Pyramid pyramid;
  buildPyramid(ColourImage(8, 8), depth, {10, 10, 3.5, 3.5, 8, 8}, 2, pyramid);
  const Image<float>& half = pyramid[1].depth_m;
  EXPECT_FLOAT_EQ(half.at(0, 0), 1.0f);
  EXPECT_FLOAT_EQ(half.at(1, 0), 1.0f) << "the nearer side of the edge";
  EXPECT_FLOAT_EQ(half.at(2, 0), 3.0f);
  EXPECT_FLOAT_EQ(half.at(3, 3), 3.0f) << "one of four is enough";
  EXPECT_EQ(half.at(2, 3), 0.0f) << "none of four is none";
}

TEST(Pyramid, memoryIsReusedAndNothingOfTheLastFrameStays) {
  Pyramid pyramid;
  const Frame frame = Scene::room().render(smallCamera(), Pose());
  buildPyramid(frame.colour, frame.depth, frame.camera, kLevels, 0.3f, 6, pyramid);
  const float* before = pyramid[2].depth_m.data();
  const DepthImage none(320, 240);
  buildPyramid(ColourImage(320, 240), none, frame.camera, kLevels, 0.3f, 6, pyramid);
  EXPECT_EQ(pyramid[2].depth_m.data(), before);
  for (const PyramidLevel& level : pyramid) {
    EXPECT_EQ(level.depth_m, Image<float>(level.depth_m.width(), level.depth_m.height()));
    EXPECT_EQ(level.grey, Image<float>(level.grey.width(), level.grey.height()));
  }
}

}  // namespace
}  // namespace comap
