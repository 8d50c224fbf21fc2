#include "edge_agent/map_cache/map_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace comap {
namespace {

Pose shifted(double x_m, double y_m = 0, double yaw_rad = 0) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, y_m, 0)};
}

Matrix6d known(double metres, double radians) {
  Vector6d weights;
  weights << Eigen::Vector3d::Constant(1 / (metres * metres)), Eigen::Vector3d::Constant(1 / (radians * radians));
  return weights.asDiagonal();
}

double sigma(const MapFilter& filter, int i) { return std::sqrt(filter.covariance()(i, i)); }

TEST(MapFilter, WhatIsKnownFadesWithTheWayAndComesBackWithARegistration) {
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  const double at_first = sigma(filter, 0);
  for (int i = 1; i <= 200; ++i) filter.move(shifted(0.02 * i), false);
  const double walked = sigma(filter, 0);
  EXPECT_GT(walked, 2 * at_first);
  EXPECT_TRUE(filter.measure(shifted(4.04), known(0.001, 0.001)));
  EXPECT_LT(sigma(filter, 0), 0.3 * walked);
  EXPECT_NEAR(filter.T_map_cam().translation().x(), 4.04, 0.003) << "fresher than the odometry";
}

TEST(MapFilter, TheOdometryFrameIsNotTouchedOnlyWhereItStands) {
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  filter.move(shifted(1), false);
  ASSERT_TRUE(filter.measure(shifted(1.01), known(0.001, 0.001)));
  const Pose T_map_odom = filter.T_map_odom();
  filter.move(shifted(2), false);
  EXPECT_TRUE((T_map_odom.inverse() * filter.T_map_odom()).log().isZero(1e-12));
  EXPECT_TRUE((filter.T_map_cam().inverse() * T_map_odom * shifted(2)).log().isZero(1e-12));
}

TEST(MapFilter, WhatDoesNotFitIsNotWeighedIn) {
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  filter.move(shifted(0.5), false);
  EXPECT_FALSE(filter.measure(shifted(0.8), known(0.001, 0.001)));
  EXPECT_NEAR(filter.T_map_cam().translation().x(), 0.5, 1e-9);
  Matrix6d nothing = Matrix6d::Zero();
  EXPECT_FALSE(filter.measure(shifted(0.5), nothing)) << "no information at all";
}

TEST(MapFilter, AFreeDirectionIsLeftToWhatWasKnown) {
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  filter.move(shifted(1), false);
  Matrix6d information = known(0.001, 0.001);
  information(0, 0) = 1 / (0.3 * 0.3);  // along a corridor
  ASSERT_TRUE(filter.measure(shifted(1.1, 0.03), information));
  EXPECT_NEAR(filter.T_map_cam().translation().x(), 1, 0.002);
  EXPECT_NEAR(filter.T_map_cam().translation().y(), 0.03, 0.003);
}

TEST(MapFilter, ACorrectionThatFitsIsWeighedAndOneThatDoesNotReplaces) {
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  filter.move(shifted(1), false);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(filter.measure(shifted(1.03), known(0.001, 0.001)));
  EXPECT_TRUE(filter.correct(Pose(), {2, 0.5, 0})) << "of a keyframe two metres ago";
  EXPECT_NEAR(filter.T_map_cam().translation().x(), 1.03, 0.003) << "says less than twenty registrations";
  EXPECT_FALSE(filter.correct(shifted(5), {}));
  EXPECT_NEAR(filter.T_map_cam().translation().x(), 6, 1e-9);
}

// What the robot is off by, at worst, on a walk of 4 m with an odometry that drifts by a share of the way and
// registrations that are all wrong by the same.
double worstError_m(double drift, double wrong_m) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.0005);
  MapFilter filter{MapFilterOptions{}};
  filter.set(Pose(), {});
  double worst = 0;
  for (int i = 1; i <= 200; ++i) {
    filter.move(shifted(0.02 * i * (1 + drift)), false);
    if (i % 5 == 0) {
      EXPECT_TRUE(filter.measure(shifted(0.02 * i + wrong_m + noise(random), noise(random)), known(0.001, 0.001)));
    }
    worst = std::max(worst, std::abs(filter.T_map_cam().translation().x() - 0.02 * i));
  }
  return worst;
}

TEST(MapFilter, WhatRegistrationsAreWrongByDoesNotMoveAnOdometryThatHolds) {
  EXPECT_LT(worstError_m(0, 0.001), 0.0003);
}

TEST(MapFilter, WhatRegistrationsAreWrongByIsWhatADriftIsBoundedBy) {
  EXPECT_LT(worstError_m(0.02, 0.002), 0.01) << "of 80 mm";
  EXPECT_LT(worstError_m(0.05, -0.002), 0.01) << "of 200 mm";
}

}  // namespace
}  // namespace comap
