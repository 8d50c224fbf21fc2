#include "tests/benchmarks/odometry/scores.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

// A walk along x at 0.6 m/s and 30 frames/s; the estimate's steps are longer by `scale`, and it turns by `turn` a
// frame.
std::vector<PosePair> walk(int frames, double scale, double turn) {
  std::vector<PosePair> pairs;
  Pose estimate;
  const Pose T_other_odom(Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ())), {5, 6, 7});
  for (int i = 0; i < frames; ++i) {
    const int64_t stamp_ns = i * 1'000'000'000ll / 30;
    const Pose truth(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.02 * i, 0, 0));
    pairs.push_back({{stamp_ns, T_other_odom * estimate}, {stamp_ns, truth}});
    estimate = estimate * Pose(Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX())),
                               Eigen::Vector3d(0.02 * scale, 0, 0));
  }
  return pairs;
}

TEST(OdometryScores, AnExactEstimateInAnotherFrameHasNoError) {
  const auto pairs = walk(200, 1, 0);
  const RelativeError relative = relativeErrorOverSecond(pairs);
  EXPECT_EQ(relative.spans, 170u);
  EXPECT_LT(relative.translation_worst_m, 1e-9);
  EXPECT_LT(relative.rotation_worst_deg, 1e-5);
  ASSERT_TRUE(driftPercent(pairs, 1));
  EXPECT_LT(*driftPercent(pairs, 1), 1e-7);
  EXPECT_NEAR(pathLength_m(pairs), 3.98, 1e-9);
}

TEST(OdometryScores, StepsTwoPercentTooLongAreTwoPercentDrift) {
  const auto pairs = walk(200, 1.02, 0);
  EXPECT_NEAR(*driftPercent(pairs, 1), 2, 1e-6);
  const RelativeError relative = relativeErrorOverSecond(pairs);
  EXPECT_NEAR(relative.translation_median_m, 0.6 * 0.02, 1e-9);
  EXPECT_NEAR(relative.translation_worst_m, 0.6 * 0.02, 1e-9);
}

TEST(OdometryScores, AConstantTurnAddsUpOverTheSecond) {
  const RelativeError relative = relativeErrorOverSecond(walk(100, 1, 0.001));
  EXPECT_NEAR(relative.rotation_median_deg, 30 * 0.001 * 180 / M_PI, 1e-6);
}

TEST(OdometryScores, OneJumpIsTheWorstAndNotTheMedian) {
  auto pairs = walk(200, 1, 0);
  for (size_t i = 190; i < pairs.size(); ++i)
    pairs[i].estimate.pose = Pose(Eigen::Quaterniond::Identity(), {0, 0.5, 0}) * pairs[i].estimate.pose;
  const RelativeError relative = relativeErrorOverSecond(pairs);
  EXPECT_LT(relative.translation_median_m, 1e-9);
  EXPECT_NEAR(relative.translation_worst_m, 0.5, 1e-9);
}

TEST(OdometryScores, AGapInTheRecordingHasNoSpanAcrossIt) {
  auto pairs = walk(60, 1, 0);
  pairs.erase(pairs.begin() + 30, pairs.begin() + 40);
  EXPECT_EQ(relativeErrorOverSecond(pairs).spans, 20u);
}

TEST(OdometryScores, TooShortAPathHasNoDrift) { EXPECT_FALSE(driftPercent(walk(20, 1, 0), 1)); }

TEST(OdometryScores, QuantilesOfValuesInAnyOrder) {
  EXPECT_EQ(quantileOf({}, 0.5), 0);
  EXPECT_EQ(quantileOf({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantileOf({3, 1, 2}, 1), 3);
  EXPECT_EQ(quantileOf({3, 1, 2}, 0), 1);
}

}  // namespace
}  // namespace comap
