#include "edge_agent/odometry/recovery.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping_core/ferns/fern_encoder.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

struct View {
  Pyramid pyramid;
  FernCode code;
};

View look(const Scene& scene, const Pose& T_world_cam) {
  static const FernBook kBook = FernBook::standard();
  const Frame frame = scene.render(kinectCamera(), T_world_cam);
  View view;
  buildPyramid(frame.colour, frame.depth, frame.camera, 4, 0.3f, 6, view.pyramid);
  view.code = encodeFerns(kBook, frame.colour, frame.depth);
  return view;
}

Pose place(int i) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.25 * i, Eigen::Vector3d::UnitY())), {0.1 * i, 0, -0.5});
}

Recovery robotThatKnowsTheRoom(const RecoveryOptions& options) {
  Recovery recovery(options);
  for (int i = 0; i < 5; ++i) {
    const View view = look(Scene::room(), place(i));
    recovery.remember(static_cast<uint32_t>(i), place(i), view.code, view.pyramid);
  }
  return recovery;
}

TEST(Recovery, withoutMemoryANewChainBeginsAtOnce) {
  Recovery recovery({});
  const View view = look(Scene::room(), Pose());
  EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kNewChain);
}

TEST(Recovery, aPlaceIsBelievedOnceTheNextFrameConfirmsIt) {
  Recovery recovery = robotThatKnowsTheRoom({});
  const Pose seen = place(2) * Pose(Eigen::Quaterniond::Identity(), {0.05, 0, 0.02});
  const View view = look(Scene::room(), seen);
  EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kLost);
  ASSERT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kFound);
  const Pose found = recovery.place().T_odom_keyframe * recovery.place().T_keyframe_cam;
  EXPECT_LT((found.translation() - seen.translation()).norm(), 0.01);
  EXPECT_LT((found.inverse() * seen).angle(), 0.01);
}

TEST(Recovery, answersThatContradictEachOtherAreNotBelieved) {
  Recovery recovery = robotThatKnowsTheRoom({});
  for (int i = 0; i < 4; ++i) {
    const View view = look(Scene::room(), place(i % 2 == 0 ? 0 : 4));
    EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kLost) << i;
  }
}

TEST(Recovery, anUnknownRoomBecomesANewChainAfterPatience) {
  RecoveryOptions options;
  options.patience_frames = 3;
  Recovery recovery = robotThatKnowsTheRoom(options);
  const View view = look(Scene::room(7), Pose());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kLost) << i;
  EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kNewChain);
  recovery.reset();
  EXPECT_EQ(recovery.attempt(view.pyramid, view.code), Recovery::Outcome::kLost) << "patience is new after a reset";
}

}  // namespace
}  // namespace comap
