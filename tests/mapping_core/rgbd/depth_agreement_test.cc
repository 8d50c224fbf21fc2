#include "mapping_core/rgbd/depth_agreement.h"

#include <gtest/gtest.h>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr size_t kLevel = 1;  // 160x120
constexpr double kGate_m = 0.05;

PyramidLevel levelOf(const Frame& frame) {
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, kLevel + 1, 0.3f, 6, pyramid);
  return pyramid[kLevel];
}

PyramidLevel room(const Pose& T_world_cam) { return levelOf(Scene::room().render(smallCamera(), T_world_cam)); }
PyramidLevel wall(double depth_m) {
  return levelOf(Scene::plainPlane({0, 0, depth_m}, {0, 0, -1}).render(smallCamera(), Pose()));
}

TEST(DepthAgreement, twoViewsOfOneRoomAgreeAtTheTruePose) {
  const Pose T_a_b(Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())), {0.15, -0.05, 0.1});
  const PyramidLevel a = room(Pose()), b = room(T_a_b);
  const DepthAgreement there = compareDepth(a, b, T_a_b, kGate_m, {});
  const DepthAgreement back = compareDepth(b, a, T_a_b.inverse(), kGate_m, {});
  EXPECT_GT(there.agree, 0.9);
  EXPECT_LT(there.seen_through, 0.02);
  EXPECT_GT(back.agree, 0.9);
  EXPECT_LT(back.seen_through, 0.02);
  EXPECT_LT(compareDepth(a, b, Pose(), kGate_m, {}).agree, there.agree - 0.1) << "a wrong pose must cost agreement";
}

TEST(DepthAgreement, aSurfaceBehindIsSeenThroughAndOneInFrontIsAnOcclusion) {
  const DepthAgreement behind = compareDepth(wall(2), wall(2.5), Pose(), kGate_m, {});
  EXPECT_EQ(behind.seen_through, 1);
  EXPECT_EQ(behind.agree, 0);
  const DepthAgreement before = compareDepth(wall(2), wall(1.5), Pose(), kGate_m, {});
  EXPECT_EQ(before.seen_through, 0);
  EXPECT_EQ(before.agree, 0);
  // The same walls where the second camera stands half a metre further back.
  EXPECT_EQ(compareDepth(wall(2), wall(2.5), Pose(Eigen::Quaterniond::Identity(), {0, 0, -0.5}), kGate_m, {}).agree, 1);
}

TEST(DepthAgreement, theGateGrowsWithTheNoiseOfFarDepth) {
  const DepthNoiseModel noise;
  const double near_m = 4.5, apart_m = 2.5 * noise.sigma(static_cast<float>(near_m));
  ASSERT_GT(apart_m, kGate_m);
  EXPECT_EQ(compareDepth(wall(near_m), wall(near_m + apart_m), Pose(), kGate_m, noise).agree, 1);
}

TEST(DepthAgreement, nothingToCompareIsNoAgreement) {
  PyramidLevel empty = wall(2);
  empty.depth_m = Image<float>(empty.depth_m.width(), empty.depth_m.height());
  const Pose turned(Eigen::Quaterniond(Eigen::AngleAxisd(3.1, Eigen::Vector3d::UnitY())), {0, 0, 0});
  for (const DepthAgreement& agreement :
       {compareDepth(wall(2), empty, Pose(), kGate_m, {}), compareDepth(empty, wall(2), Pose(), kGate_m, {}),
        compareDepth(wall(2), wall(2), turned, kGate_m, {})}) {
    EXPECT_EQ(agreement.seen_through, 1);
    EXPECT_EQ(agreement.agree, 0);
  }
}

}  // namespace
}  // namespace comap
