#include "fleet_tools/replay/run_trajectory.h"

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace comap {
namespace {

Pose at(double x) { return Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0)); }

struct Recorded {
  AgentReport report;
  std::map<KeyframeId, StoredKeyframe> keyframes;
  std::map<KeyframeId, Edge> odometry_from;
};

// Keyframes 0 and 1, odometry 1 m apart; two frames between them at 0.25 and 0.5 m... in the graph they are `apart` m.
Recorded walk(double apart) {
  Recorded run;
  run.report.robot = std::string("a");
  run.report.session = 1;
  for (uint32_t i : {0u, 1u}) {
    StoredKeyframe keyframe;
    keyframe.id = {"a", 1, i};
    keyframe.map = MapId("m");
    keyframe.T_map_cam = at(10 + i * apart);
    run.keyframes[keyframe.id] = keyframe;
  }
  Edge edge;
  edge.from = {"a", 1, 0};
  edge.to = {"a", 1, 1};
  edge.T_from_to = at(1);
  run.odometry_from[edge.from] = edge;
  run.report.trajectory = {{0, 0, at(0), TrackingState::kOk},
                           {1, 0, at(0.25), TrackingState::kOk},
                           {2, 0, at(0.5), TrackingState::kOk},
                           {3, 0, at(0.75), TrackingState::kOk},
                           {4, 1, at(0), TrackingState::kOk}};
  return run;
}

TEST(RunTrajectory, FramesStandWhereOdometryPutThemIfTheGraphAgrees) {
  const Recorded run = walk(1);
  const auto poses = composeTrajectory(run.report, "m", run.keyframes, run.odometry_from);
  ASSERT_EQ(poses.size(), 5u);
  for (size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(poses[i].pose.translation().x(), 10 + 0.25 * static_cast<double>(i), 1e-12);
}

TEST(RunTrajectory, TheGraphsCorrectionGrowsTowardsTheNextKeyframe) {
  const Recorded run = walk(1.2);
  const auto poses = composeTrajectory(run.report, "m", run.keyframes, run.odometry_from);
  ASSERT_EQ(poses.size(), 5u);
  const double expected[] = {10, 10.3, 10.6, 10.9, 11.2};
  for (size_t i = 0; i < 5; ++i) EXPECT_NEAR(poses[i].pose.translation().x(), expected[i], 1e-12) << i;
}

TEST(RunTrajectory, WhereARobotFoundBackToIsNotTheNextKeyframe) {
  const auto edge = [](uint32_t from, uint32_t to, EdgeKind kind) {
    Edge one;
    one.from = {"a", 1, from};
    one.to = {"a", 1, to};
    one.kind = kind;
    return one;
  };
  const std::vector<Edge> edges = {edge(3, 4, EdgeKind::kOdometry), edge(3, 9, EdgeKind::kOdometry),
                                   edge(5, 6, EdgeKind::kCovisibility)};
  const auto from = odometryToNext(edges);
  ASSERT_EQ(from.size(), 1u);
  EXPECT_EQ(from.at({"a", 1, 3}).to.sequence, 4u);
}

TEST(RunTrajectory, FramesOfAnotherMapOrWithoutKeyframeAreLeftOut) {
  Recorded run = walk(1);
  run.keyframes.at({"a", 1, 1}).map = MapId("other");
  EXPECT_EQ(composeTrajectory(run.report, "m", run.keyframes, run.odometry_from).size(), 4u);
  EXPECT_EQ(composeTrajectory(run.report, "other", run.keyframes, run.odometry_from).size(), 1u);
  run.keyframes.erase({"a", 1, 1});
  run.odometry_from.clear();
  EXPECT_EQ(composeTrajectory(run.report, "m", run.keyframes, run.odometry_from).size(), 4u);
}

TEST(RunTrajectory, WritesExactStamps) {
  const std::string path = (std::filesystem::temp_directory_path() / fmt::format("t-{}", getpid())).string();
  ASSERT_TRUE(writeTrajectory(path, {{1305031102175304001, at(1.5)}}));
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line,
            "1305031102.175304001 1.500000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000");
  std::filesystem::remove(path);
  EXPECT_FALSE(writeTrajectory("/nonexistent/folder/x", {}));
}

}  // namespace
}  // namespace comap
