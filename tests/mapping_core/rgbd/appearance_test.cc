#include "mapping_core/rgbd/appearance.h"

#include <gtest/gtest.h>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr DepthNoiseModel kNoise;

PyramidLevel levelOf(const Frame& frame) {
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, 3, 0.3f, 6.0f, pyramid);
  return pyramid[2];
}

PyramidLevel view(const Scene& scene, const Pose& T_world_cam) {
  return levelOf(scene.render(kinectCamera(), T_world_cam));
}

const Pose kHere(Eigen::Quaterniond::Identity(), {0, 0, -0.8});
const Pose kAside(Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())), {0.2, 0.05, -0.7});

TEST(Appearance, aPlaceLooksLikeItselfFromAside) {
  const Scene room = Scene::room();
  const Appearance seen = compareAppearance(view(room, kHere), view(room, kAside), kHere.inverse() * kAside, kNoise);
  EXPECT_GT(seen.patches, 100u);
  EXPECT_GT(seen.textured, 50u);
  EXPECT_LT(seen.unlikeShare(), 0.02);
  EXPECT_GT(seen.featureShare(), 0.15);
}

TEST(Appearance, exposureDoesNotMatter) {
  const Scene room = Scene::room();
  const PyramidLevel bright = view(room, kHere);
  PyramidLevel dark = bright;
  for (int y = 0; y < dark.grey.height(); ++y)
    for (int x = 0; x < dark.grey.width(); ++x) dark.grey.at(x, y) = 0.6f * dark.grey.at(x, y) - 15;
  EXPECT_EQ(compareAppearance(bright, dark, Pose(), kNoise).unlike, 0u);
}

TEST(Appearance, aRoomOfTheSameShapeWithOtherPicturesIsUnlike) {
  const Appearance seen = compareAppearance(view(Scene::room(1), kHere), view(Scene::room(2), kHere), Pose(), kNoise);
  EXPECT_GT(seen.textured, 50u);
  EXPECT_GT(seen.unlikeShare(), 0.3);
}

// A wrong pose along surfaces that do not contradict it: what is on them does.
TEST(Appearance, aPictureThatSlidIsUnlike) {
  const Scene room = Scene::room();
  PyramidLevel flat = view(room, kHere);
  for (int y = 0; y < flat.depth_m.height(); ++y)
    for (int x = 0; x < flat.depth_m.width(); ++x) flat.depth_m.at(x, y) = 2;
  const Pose slid(Eigen::Quaterniond::Identity(), {0.25, 0, 0});
  EXPECT_EQ(compareAppearance(flat, flat, Pose(), kNoise).unlike, 0u);
  EXPECT_GT(compareAppearance(flat, flat, slid, kNoise).unlikeShare(), 0.2);
}

TEST(Appearance, aBareWallHasNoFeatures) {
  const Frame wall = Scene::plainPlane({0, 0, 1.5}, {0, 0, -1}).render(kinectCamera(), Pose());
  const Appearance seen = compareAppearance(levelOf(wall), levelOf(wall), Pose(), kNoise);
  EXPECT_GT(seen.patches, 100u);
  EXPECT_EQ(seen.featureShare(), 0);
  EXPECT_EQ(seen.unlikeShare(), 0);
}

// Only what both see on one surface is compared: not where one has no depth, nor what lies elsewhere.
TEST(Appearance, otherSurfacesAreNotCompared) {
  const Scene room = Scene::room();
  const PyramidLevel near = view(room, kHere);
  PyramidLevel far = near, blind = near;
  for (int y = 0; y < far.depth_m.height(); ++y)
    for (int x = 0; x < far.depth_m.width(); ++x) {
      far.depth_m.at(x, y) *= 1.5f;
      blind.depth_m.at(x, y) = 0;
    }
  EXPECT_EQ(compareAppearance(near, far, Pose(), kNoise).patches, 0u);
  EXPECT_EQ(compareAppearance(near, blind, Pose(), kNoise).patches, 0u);
  EXPECT_EQ(compareAppearance(blind, near, Pose(), kNoise).patches, 0u);
}

}  // namespace
}  // namespace comap
