#include "edge_agent/keyframes/keyframe_selector.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

// A well tracked frame close to its keyframe.
TrackedFrame calm() {
  TrackedFrame tracked;
  tracked.alignment.solved = true;
  tracked.aligned = true;
  tracked.alignment.overlap = 0.95;
  return tracked;
}

std::string_view reasonOf(const TrackedFrame& tracked, int frames_since = 3, double median_depth_m = 2) {
  return keyframeReason(tracked, frames_since, median_depth_m, {});
}

Pose moved(double metres) { return Pose(Eigen::Quaterniond::Identity(), {0, 0, metres}); }
Pose turned(double radians) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitY())), {0, 0, 0});
}

TEST(KeyframeSelector, aCalmFrameIsNone) { EXPECT_EQ(reasonOf(calm()), ""); }

TEST(KeyframeSelector, theFirstOfAChainAlways) {
  TrackedFrame tracked = calm();
  tracked.first = true;
  EXPECT_EQ(reasonOf(tracked, 0), "first");
}

TEST(KeyframeSelector, enteringAndLeavingPoor) {
  TrackedFrame changed = calm();
  changed.changed = true;
  EXPECT_EQ(reasonOf(changed), "state");
  changed.aligned = false;
  EXPECT_EQ(reasonOf(changed), "") << "its pose is no measurement";
}

TEST(KeyframeSelector, translationScalesWithDepth) {
  TrackedFrame tracked = calm();
  tracked.T_keyframe_cam = moved(0.09);
  EXPECT_EQ(reasonOf(tracked), "");
  tracked.T_keyframe_cam = moved(0.11);
  EXPECT_EQ(reasonOf(tracked), "translation");
  EXPECT_EQ(reasonOf(tracked, 3, 4), "") << "twice as far, twice the way";
  tracked.T_keyframe_cam = moved(0.06);
  EXPECT_EQ(reasonOf(tracked, 3, 1), "translation") << "half as far, half the way";
}

TEST(KeyframeSelector, translationNeverShrinksToNothing) {
  TrackedFrame tracked = calm();
  tracked.T_keyframe_cam = moved(0.02);
  EXPECT_EQ(reasonOf(tracked, 3, 0.01), "");
  EXPECT_EQ(reasonOf(tracked, 3, 0), "") << "no depth at all";
}

TEST(KeyframeSelector, rotation) {
  TrackedFrame tracked = calm();
  tracked.T_keyframe_cam = turned(0.13);
  EXPECT_EQ(reasonOf(tracked), "");
  tracked.T_keyframe_cam = turned(-0.15);
  EXPECT_EQ(reasonOf(tracked), "rotation");
}

TEST(KeyframeSelector, lostOverlap) {
  TrackedFrame tracked = calm();
  tracked.alignment.overlap = 0.76;
  EXPECT_EQ(reasonOf(tracked), "");
  tracked.alignment.overlap = 0.74;
  EXPECT_EQ(reasonOf(tracked), "overlap");
  tracked.aligned = false;  // then the pose is no measurement, and the overlap means nothing
  EXPECT_EQ(reasonOf(tracked), "");
}

TEST(KeyframeSelector, afterThirtyFramesAtTheLatest) {
  EXPECT_EQ(reasonOf(calm(), 29), "");
  EXPECT_EQ(reasonOf(calm(), 30), "frames");
}

TEST(MedianDepth, ofValidPixelsOnly) {
  DepthImage depth(64, 64);
  EXPECT_EQ(medianDepth(depth), 0);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 32; ++x) depth.at(x, y) = 7500;
  EXPECT_DOUBLE_EQ(medianDepth(depth), 1.5);
  EXPECT_EQ(medianDepth(DepthImage()), 0);
}

}  // namespace
}  // namespace comap
