#include "protocol/types/keyframe_link.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(JoinLinks, CovariancesAdd) {
  const Pose T(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  const KeyframeLink once{true, 3, T, Matrix6d::Identity() * 100};
  const KeyframeLink twice = joinLinks(once, {true, 4, T, Matrix6d::Identity() * 100});
  EXPECT_EQ(twice.linked_to, 3u);
  EXPECT_NEAR(twice.T_link_this.translation().x(), 2, 1e-12);
  EXPECT_NEAR(twice.information(3, 3), 50, 1e-6) << "turning about the way adds plainly";
  const Matrix6d covariance = twice.information.inverse();
  EXPECT_NEAR(covariance(1, 1), 0.03, 1e-9) << "sideways: both, and the turn of the second over the first's length";
  EXPECT_FALSE(joinLinks({}, once).linked);
}

}  // namespace
}  // namespace comap
