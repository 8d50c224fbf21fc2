#include "fleet_tools/synth/synth_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "fleet_tools/synth/synth_random.h"

namespace comap {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;

const Scene& sceneOf(const std::string& name) {
  static std::map<std::string, Scene> scenes;
  if (!scenes.count(name)) scenes.emplace(name, makeScene(name, 1).value());
  return scenes.at(name);
}

std::vector<Pose> walk(const std::string& scene, size_t robot, int frames, uint64_t seed = 1) {
  return walkRoute(sceneOf(scene).routes.at(robot), frames, mixBits(seed, 1000 + robot));
}

// Frames of `from` that have a similar view (0.25 m, 12 deg) in `to`, at a time at least `apart` frames away.
int similarViews(const std::vector<Pose>& from, const std::vector<Pose>& to, int apart) {
  int count = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    for (size_t j = 0; j < to.size(); ++j) {
      if (std::abs(static_cast<int>(i) - static_cast<int>(j)) < apart) continue;
      const Pose between = from[i].inverse() * to[j];
      if (between.translation().norm() < 0.25 && between.angle() * kDegrees < 12) {
        ++count;
        break;
      }
    }
  }
  return count;
}

class PathInScene : public ::testing::TestWithParam<const char*> {};

TEST_P(PathInScene, WalksLikeAPersonAndTouchesNothing) {
  for (size_t robot = 0; robot < sceneOf(GetParam()).routes.size(); ++robot) {
    const auto poses = walk(GetParam(), robot, 1500);
    double length = 0, fastest = 0, closest = 10;
    for (size_t i = 0; i < poses.size(); ++i) {
      EXPECT_GE(poses[i].translation().z(), 1.2);
      EXPECT_LE(poses[i].translation().z(), 1.5);
      for (const auto& primitive : sceneOf(GetParam()).primitives) {
        closest = std::min(closest, static_cast<double>(clearance(primitive, poses[i].translation().cast<float>())));
      }
      if (i == 0) continue;
      const Pose step = poses[i - 1].inverse() * poses[i];
      length += step.translation().norm();
      fastest = std::max(fastest, step.angle() * kDegrees * kSynthRate_hz);
      EXPECT_LT(step.translation().norm() * kSynthRate_hz, 0.75);
    }
    const double mean = length / static_cast<double>(poses.size() - 1) * kSynthRate_hz;
    EXPECT_GT(mean, 0.33) << GetParam() << " robot " << robot;
    EXPECT_LT(mean, 0.55) << GetParam() << " robot " << robot;
    EXPECT_LT(fastest, 45) << GetParam() << " robot " << robot;
    EXPECT_GE(closest, 0.3) << GetParam() << " robot " << robot;
  }
}

TEST_P(PathInScene, IsSmooth) {
  for (size_t robot = 0; robot < sceneOf(GetParam()).routes.size(); ++robot) {
    const auto poses = walk(GetParam(), robot, 600);
    for (size_t i = 2; i < poses.size(); ++i) {
      const Eigen::Vector3d bend = poses[i].translation() - 2 * poses[i - 1].translation() + poses[i - 2].translation();
      EXPECT_LT(bend.norm() * kSynthRate_hz * kSynthRate_hz, 2.5) << "m/s^2, " << GetParam() << " frame " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PathInScene, ::testing::Values("flat", "twins", "mirror", "doors", "blank", "corridor"));

TEST(PathOverlap, NeighboursSeeTheSameAtDifferentTimes) {
  for (const char* scene : {"flat", "corridor"}) {
    for (const int frames : {60, 120, 200, 400}) {
      // The chain c, a, b, d: the last frames of one meet the first of the next.
      for (const auto& [earlier, later] : {std::pair<size_t, size_t>{0, 1}, {2, 0}, {1, 3}}) {
        const int met = similarViews(walk(scene, earlier, frames), walk(scene, later, frames), frames / 3);
        EXPECT_GE(met, frames / 10) << scene << " robots " << earlier << " and " << later << ", frames " << frames;
      }
    }
  }
}

TEST(PathOverlap, DefaultFlatHasTensOfFramesAndStartsApart) {
  const auto a = walk("flat", 0, 200), b = walk("flat", 1, 200);
  EXPECT_LT(a.front().translation().x(), 4.6) << "a starts in room 1";
  EXPECT_GT(b.front().translation().x(), 4.72) << "b starts in room 2";
  EXPECT_GE(similarViews(a, b, 100), 30);
  EXPECT_LE(similarViews(a, b, 0), 100) << "most of what they see is their own";
}

TEST(PathOverlap, RobotsInLookAlikePlacesNeverMeet) {
  for (const char* scene : {"twins", "mirror", "doors", "blank"}) {
    const auto a = walk(scene, 0, 600), b = walk(scene, 1, 600);
    for (const Pose& here : a)
      for (const Pose& there : b) ASSERT_GT((here.translation() - there.translation()).norm(), 1.5) << scene;
    EXPECT_GE(similarViews(a, walk(scene, 2, 600), 60), 30) << "a and c share a room of " << scene;
  }
}

}  // namespace
}  // namespace comap
