#include "edge_agent/odometry/visual_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "edge_agent/keyframes/keyframe_selector.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

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
    if (!keyframeReason(tracked, since_, medianDepth(frame.depth), {}).empty()) {
      odometry_.makeKeyframe(tracked);
      since_ = 0;
      ++keyframes_;
    } else {
      odometry_.addToKeyframe(tracked);
    }
    return tracked;
  }
  int keyframes() const { return keyframes_; }

 private:
  VisualOdometry odometry_;
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

Frame noisy(Frame frame, int seed) {
  addKinectNoise(frame, static_cast<uint64_t>(seed));
  return frame;
}

// How much of a unit direction, translation in metres at `depth_m`, the information leaves open: sigma along it.
double sigmaAlong(const Matrix6d& information, const Vector6d& direction) {
  return std::sqrt(direction.dot((information + 1e-6 * Matrix6d::Identity()).inverse() * direction));
}

// Sensor noise tilts normals and makes gradients; neither may be taken for something to hold on to.
TEST(VisualOdometry, aBareWallIsPoorInItsThreeFreeDirections) {
  for (const bool with_noise : {false, true}) {
    SCOPED_TRACE(with_noise ? "with noise" : "clean");
    Robot robot;
    const Scene wall = Scene::plainPlane({0, 0, 2}, {0, 0, -1});
    for (int i = 0; i < 12; ++i) {
      Frame frame = wall.render(kinectCamera(), Pose(Eigen::Quaterniond::Identity(), {0.005 * i, 0, 0}));
      if (with_noise) frame = noisy(frame, i + 1);
      const TrackedFrame tracked = robot.see(frame);
      if (i == 0) continue;
      EXPECT_EQ(tracked.state, TrackingState::kPoor) << "frame " << i;
      EXPECT_TRUE(tracked.degenerate);
      EXPECT_EQ(tracked.alignment.free_directions, 3) << "frame " << i;
      const Matrix6d& information = tracked.alignment.information;
      // Along the wall and about its normal nothing is known; towards it and about the other axes all is.
      for (const int open : {0, 1, 5}) EXPECT_GT(sigmaAlong(information, Vector6d::Unit(open)), 0.05) << open;
      for (const int held : {2, 3, 4}) EXPECT_LT(sigmaAlong(information, Vector6d::Unit(held)), 0.01) << held;
    }
  }
}

TEST(VisualOdometry, aCorridorIsPoorAlongItself) {
  for (const bool with_noise : {false, true}) {
    SCOPED_TRACE(with_noise ? "with noise" : "clean");
    Robot robot;
    const Scene corridor = Scene::corridor();
    for (int i = 0; i < 8; ++i) {
      Frame frame = corridor.render(kinectCamera(), Pose(Eigen::Quaterniond::Identity(), {0, 0, 0.01 * i}));
      if (with_noise) frame = noisy(frame, i + 1);
      const TrackedFrame tracked = robot.see(frame);
      if (i == 0) continue;
      EXPECT_EQ(tracked.state, TrackingState::kPoor) << "frame " << i;
      EXPECT_EQ(tracked.alignment.free_directions, 1) << "frame " << i;
      EXPECT_GT(sigmaAlong(tracked.alignment.information, Vector6d::Unit(2)), 0.05);
      for (const int held : {0, 1, 3, 4, 5})
        EXPECT_LT(sigmaAlong(tracked.alignment.information, Vector6d::Unit(held)), 0.02) << held;
    }
  }
}

// What is only partly determined is poor, however long it lasts, but not lost.
TEST(VisualOdometry, aLongWayAlongAWallKeepsTheChain) {
  const OdometryOptions options;
  Robot robot(options);
  const Scene wall = Scene::plainPlane({0, 0, 2}, {0, 0, -1});
  for (int i = 0; i < 2 * options.lost_after; ++i) {
    const TrackedFrame tracked = robot.see(wall.render(kinectCamera(), Pose()));
    EXPECT_NE(tracked.state, TrackingState::kLost) << "frame " << i;
    EXPECT_EQ(tracked.first, i == 0);
  }
}

TEST(VisualOdometry, aTexturedRoomIsDeterminedInAllDirectionsUnderNoise) {
  Robot robot;
  for (int i = 0; i < 20; ++i) {
    const TrackedFrame tracked = robot.see(noisy(view(i), i + 1));
    EXPECT_EQ(tracked.state, TrackingState::kOk) << "frame " << i;
    EXPECT_EQ(tracked.alignment.free_directions, 0) << "frame " << i;
  }
}

// 12 degrees from one frame to the next after standing still: constant velocity foresees nothing of it.
TEST(VisualOdometry, aSuddenTurnIsFollowedByThePictureAlone) {
  OdometryOptions options;
  Robot robot(options);
  const Scene room = Scene::room();
  for (int i = 0; i < 4; ++i) robot.see(room.render(kinectCamera(), Pose()));
  const Pose turned(Eigen::Quaterniond(Eigen::AngleAxisd(12 * kDegree, Eigen::Vector3d::UnitY())), {0.01, 0, 0});
  const TrackedFrame tracked = robot.see(room.render(kinectCamera(), turned));
  EXPECT_EQ(tracked.state, TrackingState::kOk);
  const Pose error = turned.inverse() * tracked.T_odom_cam;
  EXPECT_LT(error.translation().norm(), 0.01);
  EXPECT_LT(error.angle(), 0.3 * kDegree);
}

// Frames that do not fit must leave no trace: neither in the pose nor in where the next frame is looked for.
TEST(VisualOdometry, aWallHeldBeforeTheCameraMovesNothing) {
  for (const int frames : {1, 8}) {
    Robot robot;
    const Frame wall = Scene::plainPlane({0, 0, 1.5}, {0, 0, -1}).render(kinectCamera(), Pose());
    for (int i = 0; i < 10; ++i) robot.see(view(5));
    for (int i = 0; i < frames; ++i) EXPECT_NE(robot.see(wall).state, TrackingState::kOk);
    const TrackedFrame after = robot.see(view(5));
    EXPECT_EQ(after.state, TrackingState::kOk);
    EXPECT_LT(after.T_odom_cam.translation().norm(), 0.002);
    EXPECT_LT(after.T_odom_cam.angle(), 0.1 * kDegree);
  }
}

// A camera whose depth fails every other frame: the others are tracked as ever, none is a keyframe for that.
TEST(VisualOdometry, framesPassedOverMakeNoKeyframes) {
  Robot robot;
  for (int i = 0; i < 20; ++i) robot.see(i % 2 == 0 ? view(0) : blackout(i));
  EXPECT_EQ(robot.keyframes(), 1);
}

// A wall that leaves directions free is POOR though aligned: its measurements and the good ones get windows of their
// own.
TEST(VisualOdometry, aFrameWithFreeDirectionsIsAChange) {
  VisualOdometry odometry{OdometryOptions{}};
  const Frame wall = Scene::plainPlane({0, 0, 1.5}, {0, 0, -1}).render(kinectCamera(), Pose());
  odometry.makeKeyframe(odometry.track(wall));
  const TrackedFrame first = odometry.track(wall), second = odometry.track(wall);
  ASSERT_TRUE(first.aligned && first.degenerate);
  EXPECT_TRUE(first.changed);
  EXPECT_FALSE(second.changed);
}

// Carried elsewhere between two frames: it must not go on from there as if it had not moved.
TEST(VisualOdometry, aJumpElsewhereIsNeverTakenForStandingStill) {
  const OdometryOptions options;
  Robot robot(options);
  for (int i = 0; i < 5; ++i) robot.see(view(i));
  const Pose elsewhere =
      walk(5) * Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitY())), {0.6, 0, 0});
  const Frame there = Scene::room().render(kinectCamera(), elsewhere);
  for (int i = 0; i <= options.lost_after; ++i) {
    const TrackedFrame tracked = robot.see(there);
    EXPECT_EQ(tracked.state, i < options.lost_after ? TrackingState::kPoor : TrackingState::kLost) << i;
  }
}

// The geometry of another room may fit; its picture does not.
TEST(VisualOdometry, aRoomOfTheSameShapeWithOtherPicturesIsPoor) {
  Robot robot;
  for (int i = 0; i < 5; ++i) robot.see(view(i));
  const TrackedFrame tracked = robot.see(Scene::room(2).render(kinectCamera(), walk(5)));
  EXPECT_NE(tracked.state, TrackingState::kOk);
}

// Also of pictures whose rows do not end with a whole vector.
TEST(VisualOdometry, givesTheSameBitsOnAnyNumberOfThreads) {
  for (const int width : {640, 636}) {
    std::vector<std::unique_ptr<VisualOdometry>> all;
    for (const int threads : {1, 2, 5}) {
      OdometryOptions options;
      options.threads = threads;
      all.push_back(std::make_unique<VisualOdometry>(options));
    }
    CameraModel camera = kinectCamera();
    camera.width = width;
    for (int i = 0; i < 16; ++i) {
      const Frame frame = Scene::room().render(camera, walk(i), i * 33'333'333ll);
      std::vector<TrackedFrame> tracked;
      for (auto& odometry : all) {
        tracked.push_back(odometry->track(frame));
        if (i % 7 == 0)
          odometry->makeKeyframe(tracked.back());
        else
          odometry->addToKeyframe(tracked.back());
      }
      Image<float> depth, other;
      all[0]->keyframeDepth().writeDepth(depth);
      for (size_t k = 1; k < all.size(); ++k) {
        ASSERT_EQ(tracked[k].T_odom_cam.matrix(), tracked[0].T_odom_cam.matrix()) << "frame " << i;
        ASSERT_EQ(tracked[k].alignment.information, tracked[0].alignment.information) << "frame " << i;
        all[k]->keyframeDepth().writeDepth(other);
        ASSERT_TRUE(std::equal(depth.data(), depth.data() + depth.size(), other.data())) << "frame " << i;
      }
    }
  }
}

}  // namespace
}  // namespace comap
