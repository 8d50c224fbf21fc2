#include "protocol/types/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace comap {
namespace {

Vector6d randomTwist(std::mt19937_64& random, double metres, double radians) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Vector6d twist;
  for (int i = 0; i < 6; ++i) twist(i) = unit(random);
  twist.head<3>() *= metres;
  twist.tail<3>() = twist.tail<3>().normalized() * radians;
  return twist;
}

TEST(Pose, expIsTheMatrixExponential) {
  std::mt19937_64 random(1);
  for (const double angle : {0.0, 1e-9, 1e-5, 9e-5, 2e-4, 1e-3, 0.1, 1.0, 3.0, 3.14159}) {
    const Vector6d twist = randomTwist(random, 2, angle);
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(twist.tail<3>());
    generator.topRightCorner<3, 1>() = twist.head<3>();
    const Eigen::Matrix4d expected = generator.exp();
    EXPECT_LT((Pose::exp(twist).matrix() - expected).cwiseAbs().maxCoeff(), 1e-11) << "angle " << angle;
  }
}

TEST(Pose, logUndoesExpAtAllAngles) {
  std::mt19937_64 random(2);
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-6, 9.9e-5, 1.01e-4, 3e-4, 1e-3, 1e-2, 0.5, 2.0, 3.1, 3.14159}) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d twist = randomTwist(random, 2, angle);
      EXPECT_LT((Pose::exp(twist).log() - twist).cwiseAbs().maxCoeff(), 1e-10) << "angle " << angle;
    }
  }
}

TEST(Pose, logAtHalfTurnsStaysFinite) {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i);
    const Pose half_turn(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, axis)), {1, 2, 3});
    const Vector6d twist = half_turn.log();
    ASSERT_TRUE(twist.allFinite());
    EXPECT_NEAR(twist.tail<3>().norm(), M_PI, 1e-12);
    EXPECT_LT((Pose::exp(twist).matrix() - half_turn.matrix()).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(Pose, bothSignsOfAQuaternionAreOneRotation) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  const Eigen::Quaterniond minus(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((Pose(q, {1, 0, 0}).log() - Pose(minus, {1, 0, 0}).log()).norm(), 1e-14);
  EXPECT_NEAR(Pose(minus, {0, 0, 0}).angle(), 0.7, 1e-14);
}

TEST(Pose, adjointCarriesTwistsAcross) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const Pose pose = Pose::exp(randomTwist(random, 3, 1.5));
    const Vector6d twist = randomTwist(random, 1, 0.6);
    const Pose left = Pose::exp(pose.adjoint() * twist) * pose, right = pose * Pose::exp(twist);
    EXPECT_LT((left.matrix() - right.matrix()).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Pose, inverseAndProductMatchMatrices) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 50; ++i) {
    const Pose a = Pose::exp(randomTwist(random, 3, 2.5)), b = Pose::exp(randomTwist(random, 3, 1.5));
    EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(((a * a.inverse()).matrix() - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
    const Eigen::Vector3d x(0.3, -2, 1.1);
    EXPECT_LT((a * x - (a.matrix() * x.homogeneous()).head<3>()).norm(), 1e-12);
  }
}

TEST(Pose, longProductsStayRotations) {
  const Pose step = Pose::exp((Vector6d() << 0.01, 0, 0.02, 0.001, 0.02, -0.003).finished());
  Pose pose;
  for (int i = 0; i < 100000; ++i) pose = pose * step;
  const Eigen::Matrix3d r = pose.rotationMatrix();
  EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_TRUE(pose.isFinite());
}

TEST(Pose, interpolationHitsBothEndsAndTheMiddle) {
  const Pose a(Eigen::Quaterniond::Identity(), {0, 0, 0});
  const Pose b(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY())), {2, 4, -6});
  EXPECT_LT((interpolate(a, b, 0).matrix() - a.matrix()).norm(), 1e-14);
  EXPECT_LT((interpolate(a, b, 1).matrix() - b.matrix()).norm(), 1e-14);
  const Pose middle = interpolate(a, b, 0.5);
  EXPECT_NEAR(middle.angle(), 0.5, 1e-12);
  EXPECT_LT((middle.translation() - Eigen::Vector3d(1, 2, -3)).norm(), 1e-14);
}

TEST(Pose, notANumberIsNoticed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Pose().isFinite());
  EXPECT_FALSE(Pose(Eigen::Quaterniond::Identity(), {0, nan, 0}).isFinite());
  EXPECT_FALSE(Pose(Eigen::Quaterniond(nan, 0, 0, 0), {0, 0, 0}).isFinite());
}

}  // namespace
}  // namespace comap
