#include "fleet_tools/evaluate/metrics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace comap {
namespace {

constexpr double kPi = 3.14159265358979323846;

PosePair pairAt(double t, const Eigen::Vector3d& estimate, const Eigen::Vector3d& truth) {
  const auto stamp = static_cast<int64_t>(t * 1e9);
  return {{stamp, Pose(Eigen::Quaterniond::Identity(), estimate)},
          {stamp, Pose(Eigen::Quaterniond::Identity(), truth)}};
}

const std::vector<Eigen::Vector3d> kCross = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

TEST(Ate, KnownRotationAndTranslationAlignsToNothing) {
  const Pose T_truth_estimate(Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized())),
                              Eigen::Vector3d(3, -1, 0.25));
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < kCross.size(); ++i) {
    pairs.push_back(pairAt(static_cast<double>(i), kCross[i], T_truth_estimate * kCross[i]));
  }
  const auto ate = absoluteError(pairs);
  ASSERT_TRUE(ate);
  EXPECT_LT(ate->rmse_m, 1e-12);
  EXPECT_LT((ate->T_truth_estimate.matrix() - T_truth_estimate.matrix()).norm(), 1e-12);
}

TEST(Ate, ScaleIsNotForgiven) {
  // Truth is the cross, the estimate the cross of twice the size: no rigid motion helps, each point is off by 1 m.
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < kCross.size(); ++i) pairs.push_back(pairAt(static_cast<double>(i), 2 * kCross[i], kCross[i]));
  const auto ate = absoluteError(pairs);
  ASSERT_TRUE(ate);
  EXPECT_NEAR(ate->rmse_m, 1.0, 1e-9);
  EXPECT_NEAR(ate->median_m, 1.0, 1e-9);
}

TEST(Ate, AMirroredTrajectoryIsNotAlignedByAReflection) {
  std::vector<PosePair> pairs;
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}};
  for (size_t i = 0; i < points.size(); ++i) {
    pairs.push_back(pairAt(static_cast<double>(i), points[i], points[i].cwiseProduct(Eigen::Vector3d(1, 1, -1))));
  }
  const auto ate = absoluteError(pairs);
  ASSERT_TRUE(ate);
  EXPECT_GT(ate->rmse_m, 0.1);
  EXPECT_NEAR(ate->T_truth_estimate.rotationMatrix().determinant(), 1.0, 1e-9);
}

TEST(Ate, KnownOffsetsGiveTheHandComputedNumbers) {
  // Symmetric errors that neither rotation nor translation can lessen: along each arm outward, 0.1 on x, 0.2 on y, 0.3
  // on z. rmse = sqrt((0.01 + 0.04 + 0.09) / 3) = 0.2160246899.
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < kCross.size(); ++i) {
    const double stretch = 1 + 0.1 * static_cast<double>(i / 2 + 1);
    pairs.push_back(pairAt(static_cast<double>(i), stretch * kCross[i], kCross[i]));
  }
  const auto ate = absoluteError(pairs);
  ASSERT_TRUE(ate);
  EXPECT_NEAR(ate->rmse_m, 0.2160246899, 1e-6);
  EXPECT_NEAR(ate->mean_m, 0.2, 1e-6);
  EXPECT_NEAR(ate->median_m, 0.2, 1e-6);
  EXPECT_NEAR(ate->max_m, 0.3, 1e-6);
  EXPECT_EQ(ate->pairs, 6u);
}

TEST(Ate, JointAlignmentShowsWhatOwnAlignmentsHide) {
  // Both robots are perfect by themselves; robot b's map stands 0.4 m off along x. Together the best translation is in
  // the middle: each is off by 0.2 m. The points are symmetric, so that no rotation helps.
  std::vector<PosePair> a, b;
  for (size_t i = 0; i < kCross.size(); ++i) {
    const double t = static_cast<double>(i);
    a.push_back(pairAt(t, kCross[i], kCross[i]));
    b.push_back(pairAt(t, kCross[i] + Eigen::Vector3d(0.4, 0, 0), kCross[i]));
  }
  EXPECT_LT(absoluteError(a)->rmse_m, 1e-12);
  EXPECT_LT(absoluteError(b)->rmse_m, 1e-12);
  const auto joint = jointError({a, b});
  ASSERT_TRUE(joint);
  EXPECT_NEAR(joint->rmse_m, 0.2, 1e-6);
  EXPECT_EQ(joint->pairs, 12u);
  EXPECT_NEAR(errorUnder(joint->T_truth_estimate, a).rmse_m, 0.2, 1e-6);
}

TEST(Ate, TooFewPairs) {
  EXPECT_FALSE(absoluteError({}));
  EXPECT_FALSE(absoluteError({pairAt(0, {0, 0, 0}, {0, 0, 0}), pairAt(1, {1, 0, 0}, {1, 0, 0})}));
  EXPECT_FALSE(jointError({}));
}

// Truth stands still; the estimate drifts 1 cm and turns 0.2 degrees about z each tenth of a second.
std::vector<PosePair> drifting(int count) {
  std::vector<PosePair> pairs;
  const Pose step(Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * kPi / 180, Eigen::Vector3d::UnitZ())),
                  Eigen::Vector3d(0, 0, 0.01));
  Pose pose;
  for (int i = 0; i < count; ++i) {
    const int64_t stamp = int64_t{i} * 100'000'000;
    pairs.push_back({{stamp, pose}, {stamp, Pose()}});
    pose = pose * step;
  }
  return pairs;
}

TEST(Rpe, PerFrameAndPerSecond) {
  const auto pairs = drifting(31);
  const auto frame = relativeErrorPerFrame(pairs), second = relativeErrorPerSecond(pairs);
  ASSERT_TRUE(frame);
  ASSERT_TRUE(second);
  EXPECT_NEAR(frame->translation_rmse_m, 0.01, 1e-6);
  EXPECT_NEAR(frame->rotation_rmse_deg, 0.2, 1e-6);
  EXPECT_EQ(frame->pairs, 30u);
  EXPECT_NEAR(second->translation_rmse_m, 0.1, 1e-6);
  EXPECT_NEAR(second->rotation_rmse_deg, 2.0, 1e-6);
  EXPECT_EQ(second->pairs, 21u);
}

TEST(Rpe, DoesNotDependOnTheFrameOfReference) {
  auto pairs = drifting(31);
  const Pose moved(Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())), Eigen::Vector3d(1, 2, 3));
  for (auto& pair : pairs) pair.estimate.pose = moved * pair.estimate.pose;
  EXPECT_NEAR(relativeErrorPerSecond(pairs)->translation_rmse_m, 0.1, 1e-6);
}

TEST(Rpe, NoneWithoutPartners) {
  EXPECT_FALSE(relativeErrorPerSecond(drifting(9)));
  EXPECT_FALSE(relativeErrorPerFrame(drifting(1)));
}

}  // namespace
}  // namespace comap
