#include "edge_agent/odometry/visual_odometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "edge_agent/keyframes/keyframe_selector.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr double kDegree = M_PI / 180;

// A walk through the room at 30 Hz, about 0.5 m/s, turning up to 25 degrees a second.
Pose walk(int frame) {
  const double s = frame / 30.0;
  const Eigen::Vector3d place(0.5 * std::sin(0.9 * s), 0.1 * std::sin(1.3 * s), -0.8 + 0.35 * s);
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(0.4 * std::sin(0.8 * s), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(0.1 * std::sin(1.1 * s), Eigen::Vector3d::UnitX());
  return Pose(turn, place);
}

Frame view(int frame) {
  static const Scene kRoom = Scene::room();
  return kRoom.render(kinectCamera(), walk(frame), frame * 33'333'333ll);
}

Frame blackout(int frame) {
  const CameraModel camera = kinectCamera();
  return {frame * 33'333'333ll, camera, ColourImage(camera.width, camera.height),
          DepthImage(camera.width, camera.height)};
}

// Odometry and keyframe choice together, as a robot runs them.
class Robot {
 public:
  explicit Robot(const OdometryOptions& options = {}) : odometry_(options) {}

  TrackedFrame see(const Frame& frame) {
    const TrackedFrame tracked = odometry_.track(frame);
    EXPECT_TRUE(tracked.T_odom_cam.isFinite());
    EXPECT_TRUE(tracked.T_keyframe_cam.isFinite());
    EXPECT_TRUE(tracked.alignment.information.allFinite());
    ++since_;
    if (!keyframeReason(tracked, since_, medianDepth(frame.depth), state_, {}).empty()) {
      odometry_.makeKeyframe();
      since_ = 0;
      ++keyframes_;
    }
    state_ = tracked.state;
    return tracked;
  }
  int keyframes() const { return keyframes_; }

 private:
  VisualOdometry odometry_;
  TrackingState state_ = TrackingState::kOk;
  int since_ = 0, keyframes_ = 0;
};

TEST(VisualOdometry, theFirstFrameStartsAtTheOrigin) {
  VisualOdometry odometry{OdometryOptions{}};
  const TrackedFrame tracked = odometry.track(view(0));
  EXPECT_TRUE(tracked.first);
  EXPECT_EQ(tracked.T_odom_cam.matrix(), Pose().matrix());
  EXPECT_EQ(tracked.state, TrackingState::kOk);
}

TEST(VisualOdometry, driftsLessThanThreePerMille) {
  Robot robot;
  const Pose T_world_odom = walk(0);
  double path_m = 0;
  Pose error;
  constexpr int kFrames = 100;
  for (int i = 0; i < kFrames; ++i) {
    const TrackedFrame tracked = robot.see(view(i));
    EXPECT_EQ(tracked.state, TrackingState::kOk) << "frame " << i;
    EXPECT_EQ(tracked.first, i == 0);
    if (i > 0) path_m += (walk(i).translation() - walk(i - 1).translation()).norm();
    error = walk(i).inverse() * T_world_odom * tracked.T_odom_cam;
  }
  EXPECT_GT(path_m, 1);
  EXPECT_LT(error.translation().norm(), 0.003 * path_m);
  EXPECT_LT(error.angle(), 0.1 * kDegree);
  EXPECT_GT(robot.keyframes(), kFrames / 15);
  EXPECT_LT(robot.keyframes(), kFrames / 2);
}

TEST(VisualOdometry, oneFrameWithoutDepthIsPoorAndTrackingGoesOn) {
  Robot robot;
  for (int i = 0; i < 40; ++i) {
    Frame frame = view(i);
    if (i == 20) frame.depth = DepthImage(frame.camera.width, frame.camera.height);
    const TrackedFrame tracked = robot.see(frame);
    EXPECT_EQ(tracked.state, i == 20 ? TrackingState::kPoor : TrackingState::kOk) << "frame " << i;
    EXPECT_EQ(tracked.first, i == 0);
    const Pose error = walk(i).inverse() * walk(0) * tracked.T_odom_cam;
    EXPECT_LT(error.translation().norm(), 0.01) << "frame " << i;
  }
}

TEST(VisualOdometry, aShortBlackoutKeepsTheChain) {
  Robot robot;
  for (int i = 0; i < 30; ++i) {
    const bool dark = i >= 12 && i < 17;
    const TrackedFrame tracked = robot.see(dark ? blackout(i) : view(i));
    EXPECT_EQ(tracked.state, dark ? TrackingState::kPoor : TrackingState::kOk) << "frame " << i;
    EXPECT_EQ(tracked.first, i == 0);
  }
}

TEST(VisualOdometry, aLongBlackoutIsLostAndLightStartsANewChain) {
  const OdometryOptions options;
  Robot robot(options);
  constexpr int kDark = 10, kLight = 40;
  Pose T_world_odom;
  for (int i = 0; i < 60; ++i) {
    const bool dark = i >= kDark && i < kLight;
    const TrackedFrame tracked = robot.see(dark ? blackout(i) : view(i));
    if (!dark) {
      EXPECT_EQ(tracked.state, TrackingState::kOk) << "frame " << i;
      EXPECT_EQ(tracked.first, i == 0 || i == kLight) << "frame " << i;
    } else {
      EXPECT_EQ(tracked.state, i - kDark < options.lost_after ? TrackingState::kPoor : TrackingState::kLost)
          << "frame " << i;
      EXPECT_FALSE(tracked.first) << "a chain cannot start in the dark, frame " << i;
    }
    if (i == kLight) T_world_odom = walk(i) * tracked.T_odom_cam.inverse();
    if (i > kLight) {
      const Pose error = walk(i).inverse() * T_world_odom * tracked.T_odom_cam;
      EXPECT_LT(error.translation().norm(), 0.003) << "frame " << i;
    }
  }
}

// A jump no robot makes in a thirtieth of a second is a wrong alignment, not a motion.
TEST(VisualOdometry, aJumpIsNotBelieved) {
  OdometryOptions options;
  options.jump_m = 0.05;
  Robot robot(options);
  Pose before;
  for (int i = 0; i < 5; ++i) before = robot.see(view(i)).T_odom_cam;
  const Pose thrown = walk(5) * Pose(Eigen::Quaterniond::Identity(), {0.09, 0, 0});
  const TrackedFrame tracked = robot.see(Scene::room().render(kinectCamera(), thrown));
  EXPECT_EQ(tracked.state, TrackingState::kPoor);
  EXPECT_LT((tracked.T_odom_cam.translation() - before.translation()).norm(), 0.03) << "it coasts instead";
}

TEST(VisualOdometry, aBareWallIsPoor) {
  Robot robot;
  const Frame wall = Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(kinectCamera(), Pose());
  robot.see(wall);
  const TrackedFrame tracked = robot.see(wall);
  EXPECT_EQ(tracked.state, TrackingState::kPoor);
  EXPECT_LT(tracked.T_odom_cam.translation().norm(), 0.001);
}

}  // namespace
}  // namespace comap
