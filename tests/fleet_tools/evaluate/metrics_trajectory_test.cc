#include "fleet_tools/evaluate/metrics_trajectory.h"

#include <gtest/gtest.h>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

std::vector<StampedPose> at(std::initializer_list<double> seconds) {
  std::vector<StampedPose> result;
  for (const double s : seconds) {
    result.push_back({static_cast<int64_t>(s * 1e9), Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(s, 0, 0))});
  }
  return result;
}

TEST(ReadTrajectory, ReadsWhatTheFormatSays) {
  TemporaryFolder folder;
  folder.write("t.txt",
               "# timestamp tx ty tz qx qy qz qw\n\n1.5 1 -2 3e-1 0 0 0.70710678 0.70710678\n 2.5\t0 0 0 0 0 0 1\r\n");
  auto read = readTrajectory(folder / "t.txt");
  ASSERT_TRUE(read) << read.error().text;
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ(read->front().stamp_ns, 1500000000);
  EXPECT_EQ(read->front().pose.translation(), Eigen::Vector3d(1, -2, 0.3));
  EXPECT_LT((read->front().pose.rotationMatrix() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-7);
}

TEST(ReadTrajectory, RefusesWithFileAndLine) {
  TemporaryFolder folder;
  const std::pair<const char*, const char*> cases[] = {
      {"1 0 0 0 0 0 0\n", "t.txt:1: has 7 words"},
      {"1 0 0 0 0 0 0 1 9\n", "more than 8"},
      {"#\n1 0 0 x 0 0 0 1\n", "t.txt:2: tz is 'x'"},
      {"1 0 0 nan 0 0 0 1\n", "tz is 'nan'"},
      {"1 inf 0 0 0 0 0 1\n", "tx is 'inf'"},
      {"a 0 0 0 0 0 0 1\n", "timestamp 'a'"},
      {"1 0 0 0 0 0 0 0.5\n", "quaternion has length 0.5"},
      {"1 0 0 0 0 0 0 0\n", "quaternion has length 0.0"},
      {"2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "t.txt:2: timestamp 1.000000"},
      {"1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "is not later"},
      {"# nothing\n", "holds no pose"}};
  for (const auto& [text, word] : cases) {
    folder.write("t.txt", text);
    auto read = readTrajectory(folder / "t.txt");
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().code, ErrorCode::kBadData);
    EXPECT_NE(read.error().text.find(word), std::string::npos) << read.error().text;
  }
  EXPECT_EQ(readTrajectory(folder / "none.txt").error().code, ErrorCode::kUnreachable);
}

TEST(Associate, ClosestFirstEachOnceWithinTheGap) {
  // 1.000 could take 1.012, yet that is closer to 1.010; 2.000 has nothing within 0.02 s; 3.0 is exact.
  const auto pairs = associate(at({1.000, 1.010, 2.000, 3.000}), at({0.985, 1.012, 2.021, 3.000, 4.0}));
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_DOUBLE_EQ(pairs[0].truth.pose.translation().x(), 0.985);
  EXPECT_DOUBLE_EQ(pairs[1].truth.pose.translation().x(), 1.012);
  EXPECT_DOUBLE_EQ(pairs[2].truth.pose.translation().x(), 3.000);
}

TEST(Associate, ATruthServesOneEstimateOnly) {
  const auto pairs = associate(at({1.000, 1.004}), at({1.003}));
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_DOUBLE_EQ(pairs[0].estimate.pose.translation().x(), 1.004);
}

TEST(Associate, OnlyStampsTheTrajectoryHolds) {
  EXPECT_EQ(associate(at({5, 6, 7}), at({1, 2, 3, 4, 5, 6, 7, 8, 9})).size(), 3u);
  EXPECT_TRUE(associate({}, at({1})).empty());
  EXPECT_TRUE(associate(at({1}), {}).empty());
}

}  // namespace
}  // namespace comap
