#include "edge_agent/map_cache/map_registration.h"

#include <gtest/gtest.h>

#include "tests/scenes/scene_noise.h"
#include "tests/scenes/scene_tiles.h"

namespace comap {
namespace {

Pose standing(double x_m, double z_m, double yaw_rad) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0, z_m)};
}

Pose off(double metres, double radians) {
  Vector6d twist;
  twist << metres, -0.5 * metres, 0.3 * metres, 0.2 * radians, radians, -0.3 * radians;
  return Pose::exp(twist);
}

class MapRegistrationTest : public testing::Test {
 protected:
  void SetUp() override {
    cache_.setMap("m");
    static const std::vector<Tile> kTiles =
        sceneTiles(Scene::room(), {standing(0, -1, 0), standing(0.3, -0.9, 0.2), standing(-0.3, -1, -0.2)}, "m");
    for (const Tile& tile : kTiles) ASSERT_TRUE(cache_.put(tile));
  }

  // Pictures of half a camera's size take the place of levels 1 to 3.
  Pyramid view(const Scene& scene, const Pose& T_world_cam, uint64_t noise = 7) {
    Frame frame = scene.render(smallCamera(), T_world_cam);
    addKinectNoise(frame, noise);
    Pyramid pyramid;
    buildPyramid(frame.colour, frame.depth, frame.camera, 3, 0.3f, 6, pyramid);
    pyramid.insert(pyramid.begin(), PyramidLevel{});
    return pyramid;
  }

  double error_m(const Registration& found, const Pose& T_world_cam) {
    return (T_world_cam.inverse() * found.T_map_cam).translation().norm();
  }

  Scene scene_ = Scene::room();
  TileCache cache_;
  MapRegistration registration_{RegistrationOptions{}};
};

TEST_F(MapRegistrationTest, TakesDriftBackThatIsManyTimesWhatItIsWrongBy) {
  for (int i = 0; i < 4; ++i) {
    const Pose T_world_cam = standing(0.05 * i - 0.1, -0.95, 0.03 * i);
    const Registration found = registration_.near(cache_, view(scene_, T_world_cam, i), T_world_cam * off(0.05, 0.03));
    ASSERT_TRUE(found.accepted) << found.reason;
    EXPECT_LT(error_m(found, T_world_cam), 0.005);
    EXPECT_LT((T_world_cam.inverse() * found.T_map_cam).angle(), 0.003);
  }
}

TEST_F(MapRegistrationTest, WhatTheInformationSaysIsNotLessThanWhatItIsWrongBy) {
  double chi2 = 0;
  constexpr int kViews = 8;
  for (int i = 0; i < kViews; ++i) {
    const Pose T_world_cam = standing(0.03 * i - 0.1, -0.95, 0.02 * i);
    const Registration found = registration_.near(cache_, view(scene_, T_world_cam, i), T_world_cam * off(0.02, 0.01));
    ASSERT_TRUE(found.accepted) << found.reason;
    Vector6d floor;
    floor << Eigen::Vector3d::Constant(0.004 * 0.004), Eigen::Vector3d::Constant(0.002 * 0.002);
    const Vector6d error = (found.T_map_cam.inverse() * T_world_cam).log();
    const Matrix6d covariance = found.information.inverse() + Matrix6d(floor.asDiagonal());
    chi2 += error.dot(covariance.inverse() * error) / kViews;
  }
  EXPECT_LT(chi2, 12) << "6 would be exact";
}

TEST_F(MapRegistrationTest, FindsAViewFromAnywhereNearAPlace) {
  const Pose T_world_cam = standing(0.15, -0.85, 0.1);
  const Registration found = registration_.anywhere(cache_, view(scene_, T_world_cam), standing(0, -1, 0));
  ASSERT_TRUE(found.accepted) << found.reason;
  EXPECT_LT(error_m(found, T_world_cam), 0.01);
}

TEST_F(MapRegistrationTest, ARoomOfTheSameShapeThatLooksOtherwiseIsRefused) {
  const Scene other = Scene::room(2);
  const Pose T_world_cam = standing(0.05, -0.95, 0.05);
  const Pyramid live = view(other, T_world_cam);
  EXPECT_FALSE(registration_.anywhere(cache_, live, standing(0, -1, 0)).accepted);
  EXPECT_FALSE(registration_.verify(cache_, live, T_world_cam).accepted);
}

TEST_F(MapRegistrationTest, WhereNothingIsMappedItSaysSo) {
  const Pose away = standing(0, 1, M_PI);
  TileCache empty;
  EXPECT_EQ(registration_.near(empty, view(scene_, away), away).reason, "unmapped");
  EXPECT_EQ(registration_.anywhere(empty, view(scene_, away), away).reason, "unmapped");
  Pyramid few = view(scene_, away);
  few.pop_back();
  EXPECT_EQ(registration_.near(cache_, few, away).reason, "too_few_levels");
}

TEST_F(MapRegistrationTest, ViewsWithoutDepthAreRefused) {
  const Pose T_world_cam = standing(0, -1, 0);
  Pyramid blind = view(scene_, T_world_cam);
  for (PyramidLevel& level : blind) std::fill(level.depth_m.data(), level.depth_m.data() + level.depth_m.size(), 0.0f);
  EXPECT_FALSE(registration_.near(cache_, blind, T_world_cam).accepted);
}

TEST_F(MapRegistrationTest, GivesTheSameBitsAgain) {
  const Pose T_world_cam = standing(0.1, -0.9, 0.05);
  const Pyramid live = view(scene_, T_world_cam);
  const Registration first = registration_.near(cache_, live, T_world_cam * off(0.03, 0.02));
  (void)registration_.anywhere(cache_, live, standing(0.3, -0.9, 0.2));
  const Registration again = registration_.near(cache_, live, T_world_cam * off(0.03, 0.02));
  EXPECT_EQ(first.T_map_cam.matrix(), again.T_map_cam.matrix());
  EXPECT_EQ(first.information, again.information);
}

}  // namespace
}  // namespace comap
