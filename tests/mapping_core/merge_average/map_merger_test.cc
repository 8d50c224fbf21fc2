#include "mapping_core/merge/map_merger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace comap {
namespace {

KeyframeId a(uint32_t i) { return {"alpha", 1, i}; }
KeyframeId b(uint32_t i) { return {"bravo", 1, i}; }

class AverageTransform : public testing::Test {
 protected:
  AverageTransform() {
    for (uint32_t i = 0; i < 5; ++i) {
      const double s = i;
      T_map_cam_[a(i)] = Pose::exp((Vector6d() << 0.3 * s, 0.1, 0.2 * s, 0, 0.2 * s, 0.05).finished());
      // Far from its map's origin, where a wrong centre of rotation would lever.
      T_map_cam_[b(i)] = Pose::exp((Vector6d() << 20 + 0.4 * s, -0.2, 0.1 * s, 0.1, -0.15 * s, 0).finished());
    }
  }
  Closure closure(uint32_t i, const Pose& error = {}) const {
    const Pose T_a_query = T_a_b_ * T_map_cam_.at(b(i)) * error;
    return {b(i), a(i), T_map_cam_.at(a(i)).inverse() * T_a_query, Matrix6d::Identity()};
  }
  std::vector<Closure> closures(const std::vector<Pose>& errors) const {
    std::vector<Closure> all;
    for (uint32_t i = 0; i < errors.size(); ++i) all.push_back(closure(i, errors[i]));
    return all;
  }
  // How far the estimate is off where the queries stand.
  double offAtQueries(const Pose& T_a_b) const {
    double worst = 0;
    for (uint32_t i = 0; i < 5; ++i) {
      const Eigen::Vector3d x_b = T_map_cam_.at(b(i)).translation();
      worst = std::max(worst, (T_a_b * x_b - T_a_b_ * x_b).norm());
    }
    return worst;
  }

  std::map<KeyframeId, Pose> T_map_cam_;
  const Pose T_a_b_ = Pose::exp((Vector6d() << 4, 0.1, -2, 0.02, 1.2, 0).finished());
};

Pose off(double x, double y, double z, double degrees) {
  const double angle = degrees * M_PI / 180;
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized())), {x, y, z});
}

TEST_F(AverageTransform, ofClosuresThatAgreeIsExact) {
  for (const size_t count : {1u, 2u, 5u}) {
    const Pose mean = averageTransform(closures(std::vector<Pose>(count)), T_map_cam_);
    EXPECT_LT((mean.matrix() - T_a_b_.matrix()).cwiseAbs().maxCoeff(), 1e-10) << count << " closures";
  }
}

TEST_F(AverageTransform, smallErrorsAverageOut) {
  const auto all = closures({off(0.01, 0, 0, 0), off(-0.01, 0, 0, 0), off(0, 0.01, 0, 0), off(0, -0.01, 0, 0)});
  EXPECT_LT(offAtQueries(averageTransform(all, T_map_cam_)), 0.002);
  EXPECT_GT(offAtQueries(averageTransform(std::span(all).first(1), T_map_cam_)), 0.009);
}

TEST_F(AverageTransform, oneWrongOfFiveHardlyPulls) {
  for (size_t wrong = 0; wrong < 5; ++wrong) {
    std::vector<Pose> errors(5);
    errors[wrong] = off(0.4, -0.3, 0.2, 20);
    // Huber bounds the pull of one to 3 cm (and 0.03 rad) over the four others; the turn adds at the outer queries.
    const Pose mean = averageTransform(closures(errors), T_map_cam_);
    EXPECT_LT(offAtQueries(mean), 0.02) << "wrong one at " << wrong;
    EXPECT_LT((T_a_b_.inverse() * mean).angle(), 0.5 * M_PI / 180) << "wrong one at " << wrong;
  }
}

TEST_F(AverageTransform, orderDoesNotMatter) {
  auto all = closures({off(0.01, 0, 0, 0.3), off(-0.02, 0.01, 0, -0.2), off(0, 0.01, 0.02, 0), off(0.3, 0, 0, 9)});
  const Pose forward = averageTransform(all, T_map_cam_);
  std::reverse(all.begin(), all.end());
  const Pose backward = averageTransform(all, T_map_cam_);
  EXPECT_LT((forward.inverse() * backward).translation().norm(), 5e-4);
  EXPECT_LT((forward.inverse() * backward).angle(), 1e-4);
}

// Renaming either map's frame of reference renames the answer and changes nothing else.
TEST_F(AverageTransform, framesOfReferenceDoNotMatter) {
  const auto all = closures({off(0.01, 0, 0, 0.3), off(-0.02, 0.01, 0, -0.2), off(0, 0.01, 0.02, 0)});
  const Pose before = averageTransform(all, T_map_cam_);
  const Pose T_a2_a = Pose::exp((Vector6d() << -7, 2, 3, 0.3, -1.1, 0.2).finished());
  const Pose T_b2_b = Pose::exp((Vector6d() << 1, 5, -9, -0.8, 0.4, 1.3).finished());
  for (uint32_t i = 0; i < 5; ++i) {
    T_map_cam_[a(i)] = T_a2_a * T_map_cam_[a(i)];
    T_map_cam_[b(i)] = T_b2_b * T_map_cam_[b(i)];
  }
  const Pose after = averageTransform(all, T_map_cam_);
  const Pose expected = T_a2_a * before * T_b2_b.inverse();
  EXPECT_LT((after.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace comap
