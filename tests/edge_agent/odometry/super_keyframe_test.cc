#include "edge_agent/odometry/super_keyframe.h"

#include <gtest/gtest.h>

#include <cmath>

#include "edge_agent/keyframes/depth_rounding.h"
#include "protocol/codec/depth_codec.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

constexpr DepthNoiseModel kNoise;

Pyramid pyramidOf(const Frame& frame) {
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, 1, 0.3f, 6, pyramid);
  return pyramid;
}

// The camera wanders by centimetres in front of what `scene` shows.
Pose wander(int frame) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * std::sin(0.9 * frame), Eigen::Vector3d::UnitY())),
              {0.01 * frame, 0.008 * std::sin(0.7 * frame), 0.005 * std::cos(0.5 * frame)});
}

struct Window {
  Frame first;
  Image<float> depth_m;
  Image<uint8_t> hits;
};

Window windowOf(const Scene& scene, int frames, bool with_noise) {
  Window window;
  SuperKeyframe super(kNoise);
  for (int i = 0; i < frames; ++i) {
    Frame frame = scene.render(kinectCamera(), wander(i));
    if (with_noise) addKinectNoise(frame, static_cast<uint64_t>(i + 1));
    const Pyramid pyramid = pyramidOf(frame);
    if (i == 0) {
      window.first = frame;
      super.start(pyramid.front());
    } else {
      super.add(pyramid.front(), wander(0).inverse() * wander(i));
    }
  }
  EXPECT_EQ(super.frames(), frames);
  super.writeDepth(window.depth_m);
  super.writeHits(window.hits);
  return window;
}

double depthOf(float metres) { return metres; }
double depthOf(uint16_t units) { return units / kDepthUnitsPerMetre; }

// Root mean square of what is left of z after the exact view, over the pixels that have depth.
template <class T>
double rmsError(const Image<T>& depth, const Scene& scene) {
  double sum = 0, count = 0;
  for (int y = 5; y < depth.height() - 5; y += 3)
    for (int x = 5; x < depth.width() - 5; x += 3) {
      const auto exact = scene.depthAt(kinectCamera(), wander(0), x, y);
      if (!exact || depth.at(x, y) == 0 || *exact > 6) continue;
      const double error = depthOf(depth.at(x, y)) - *exact;
      sum += error * error;
      ++count;
    }
  return std::sqrt(sum / count);
}

Scene slantedPlane() { return Scene::plainPlane({0, 0, 2}, Eigen::Vector3d(0.3, 0.2, -1).normalized()); }

TEST(SuperKeyframe, ofCleanFramesIsTheKeyframeItself) {
  const Window window = windowOf(slantedPlane(), 8, false);
  EXPECT_LT(rmsError(window.depth_m, slantedPlane()), 0.0008);  // nearest pixels on a slant
}

TEST(SuperKeyframe, noiseFallsToLessThanHalfAtNoMoreBytes) {
  const Window window = windowOf(slantedPlane(), 12, true);
  const DepthImage rounded = roundDepth(window.depth_m, {});
  EXPECT_LT(rmsError(window.depth_m, slantedPlane()), 0.4 * rmsError(window.first.depth, slantedPlane()));
  EXPECT_LT(rmsError(rounded, slantedPlane()), 0.5 * rmsError(window.first.depth, slantedPlane()));
  const auto single = encodeDepth(window.first.depth), super = encodeDepth(rounded);
  ASSERT_TRUE(single);
  ASSERT_TRUE(super);
  EXPECT_LE(super->size(), single->size());
}

TEST(SuperKeyframe, countsTheFramesThatAgree) {
  const Window window = windowOf(slantedPlane(), 6, false);
  EXPECT_EQ(window.hits.at(320, 240), 6);
}

TEST(SuperKeyframe, whatOnlyTheKeyframeSawIsDropped) {
  const Scene scene = slantedPlane();
  Frame frame = scene.render(kinectCamera(), wander(0));
  for (int y = 200; y < 220; ++y)
    for (int x = 300; x < 320; ++x) frame.depth.at(x, y) = static_cast<uint16_t>(1.2 * kDepthUnitsPerMetre);
  SuperKeyframe super(kNoise);
  super.start(pyramidOf(frame).front());
  for (int i = 1; i < 4; ++i)
    super.add(pyramidOf(scene.render(kinectCamera(), wander(i))).front(), wander(0).inverse() * wander(i));
  Image<float> depth;
  super.writeDepth(depth);
  EXPECT_EQ(depth.at(310, 210), 0);
  EXPECT_GT(depth.at(310, 260), 0);
}

TEST(SuperKeyframe, holesAreFilledOnceTwoFramesAgree) {
  const Scene scene = slantedPlane();
  Frame frame = scene.render(kinectCamera(), wander(0));
  for (int y = 200; y < 240; ++y)
    for (int x = 300; x < 340; ++x) frame.depth.at(x, y) = 0;
  SuperKeyframe super(kNoise);
  super.start(pyramidOf(frame).front());
  Image<float> depth;
  const auto filled = [&] {
    super.writeDepth(depth);
    int count = 0;
    for (int y = 200; y < 240; ++y)
      for (int x = 300; x < 340; ++x) {
        if (depth.at(x, y) == 0) continue;
        ++count;
        EXPECT_NEAR(depth.at(x, y), *scene.depthAt(kinectCamera(), wander(0), x, y), 0.005);
      }
    return count;
  };
  EXPECT_EQ(filled(), 0);
  super.add(pyramidOf(scene.render(kinectCamera(), wander(1))).front(), wander(0).inverse() * wander(1));
  EXPECT_EQ(filled(), 0) << "one frame is no agreement";
  for (int i = 2; i < 6; ++i)
    super.add(pyramidOf(scene.render(kinectCamera(), wander(i))).front(), wander(0).inverse() * wander(i));
  EXPECT_GT(filled(), 1500);
}

TEST(SuperKeyframe, inheritedDepthCountsButIsNoHit) {
  const Scene scene = slantedPlane();
  const Window before = windowOf(scene, 10, true);
  Frame frame = scene.render(kinectCamera(), wander(0));
  addKinectNoise(frame, 99);
  SuperKeyframe super(kNoise);
  super.start(pyramidOf(frame).front());
  super.inherit({kinectCamera(), {}, before.depth_m}, Pose(), 4);
  Image<float> depth;
  Image<uint8_t> hits;
  super.writeDepth(depth);
  super.writeHits(hits);
  EXPECT_LT(rmsError(depth, scene), 0.6 * rmsError(frame.depth, scene));
  EXPECT_EQ(hits.at(320, 240), 1);
}

TEST(SuperKeyframe, framesOfAnotherSizeChangeNothing) {
  const Scene scene = slantedPlane();
  SuperKeyframe super(kNoise);
  super.start(pyramidOf(scene.render(kinectCamera(), Pose())).front());
  Image<float> before, after;
  super.writeDepth(before);
  super.add(pyramidOf(scene.render(smallCamera(), Pose())).front(), Pose());
  super.writeDepth(after);
  EXPECT_EQ(before, after);
}

// Widths that no vector divides: the last columns must not run into the next row.
TEST(SuperKeyframe, anyWidthWillDo) {
  const CameraModel camera{100, 100, 30.5, 20, 61, 41};
  const Scene scene = slantedPlane();
  SuperKeyframe super(kNoise);
  super.start(pyramidOf(scene.render(camera, Pose())).front());
  for (int i = 0; i < 3; ++i) super.add(pyramidOf(scene.render(camera, Pose())).front(), Pose());
  Image<uint8_t> hits;
  super.writeHits(hits);
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 61; ++x) EXPECT_EQ(hits.at(x, y), 4) << x << " " << y;
}

}  // namespace
}  // namespace comap
