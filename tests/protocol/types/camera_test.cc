#include "protocol/types/camera.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

const CameraModel kCamera{481.2, 480, 319.5, 239.5, 640, 480};
const CameraModel kUpward{481.2, -480, 319.5, 239.5, 640, 480};  // y up, as some data sets have it

TEST(CameraModel, projectUndoesUnproject) {
  for (const CameraModel& camera : {kCamera, kUpward})
    for (const double z : {0.3, 1.7, 9.0}) {
      const Eigen::Vector2d pixel(12.25, 400.75);
      EXPECT_LT((camera.project(camera.unproject(pixel.x(), pixel.y(), z)) - pixel).norm(), 1e-10);
    }
}

TEST(CameraModel, theOpticalAxisIsTheCentre) {
  EXPECT_LT((kCamera.project({0, 0, 2}) - Eigen::Vector2d(319.5, 239.5)).norm(), 1e-12);
}

TEST(CameraModel, axesPointRightAndDown) {
  EXPECT_GT(kCamera.project({0.1, 0, 1}).x(), kCamera.cx);
  EXPECT_GT(kCamera.project({0, 0.1, 1}).y(), kCamera.cy);
  EXPECT_LT(kUpward.project({0, 0.1, 1}).y(), kUpward.cy);
}

// A shrunk pixel is the mean of its block, so its centre is the block's centre.
TEST(CameraModel, shrunkPixelsLookThroughTheirBlocksCentre) {
  for (const CameraModel& camera : {kCamera, kUpward})
    for (const int factor : {2, 4, 8}) {
      const CameraModel small = camera.shrunk(factor);
      EXPECT_EQ(small.width, camera.width / factor);
      EXPECT_EQ(small.height, camera.height / factor);
      for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, 0), Eigen::Vector2d(7, 3), Eigen::Vector2d(79, 59)}) {
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        for (int y = 0; y < factor; ++y)
          for (int x = 0; x < factor; ++x)
            mean += camera.unproject(factor * pixel.x() + x, factor * pixel.y() + y, 2.5);
        mean /= factor * factor;
        EXPECT_LT((small.unproject(pixel.x(), pixel.y(), 2.5) - mean).norm(), 1e-12);
      }
    }
}

TEST(CameraModel, shrinkingTwiceIsShrinkingByFour) {
  const CameraModel a = kCamera.shrunk(2).shrunk(2), b = kCamera.shrunk(4);
  EXPECT_NEAR(a.cx, b.cx, 1e-12);
  EXPECT_NEAR(a.cy, b.cy, 1e-12);
  EXPECT_NEAR(a.fx, b.fx, 1e-12);
}

}  // namespace
}  // namespace comap
