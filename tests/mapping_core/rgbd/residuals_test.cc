#include "mapping_core/rgbd/residuals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "protocol/types/camera.h"
#include "protocol/types/pose.h"

namespace comap {
namespace {

constexpr double kStep = 1e-5;  // of the central differences: truncation and rounding both near 1e-10
constexpr double kRelative = 1e-5;

// A smooth image known everywhere, with its gradient.
struct AnalyticImage {
  double at(const Eigen::Vector2d& p) const {
    return 120 + 40 * std::sin(0.031 * p.x() + 0.4) * std::cos(0.023 * p.y()) + 25 * std::sin(0.017 * (p.x() - p.y()));
  }
  Eigen::Vector2d gradient(const Eigen::Vector2d& p) const {
    const double diagonal = 25 * 0.017 * std::cos(0.017 * (p.x() - p.y()));
    return {40 * 0.031 * std::cos(0.031 * p.x() + 0.4) * std::cos(0.023 * p.y()) + diagonal,
            -40 * 0.023 * std::sin(0.031 * p.x() + 0.4) * std::sin(0.023 * p.y()) - diagonal};
  }
};

template <class Residual>
Row6<double> numericJacobian(const Residual& residual, const Pose& T_ref_cur) {
  Row6<double> row;
  for (int i = 0; i < 6; ++i) {
    const Vector6d step = kStep * Vector6d::Unit(i);
    row(i) = (residual(Pose::exp(step) * T_ref_cur) - residual(Pose::exp(-step) * T_ref_cur)) / (2 * kStep);
  }
  return row;
}

class Residuals : public testing::Test {
 protected:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  Eigen::Vector3d point() { return {uniform(-1, 1), uniform(-1, 1), uniform(0.8, 4)}; }
  Pose pose() {
    Vector6d twist;
    for (int i = 0; i < 6; ++i) twist(i) = uniform(-0.4, 0.4);
    return Pose::exp(twist);
  }

 private:
  std::mt19937_64 random_{11};
};

TEST_F(Residuals, geometricJacobianIsExact) {
  for (int i = 0; i < 200; ++i) {
    const Pose T_ref_cur = pose();
    const Eigen::Vector3d x_cur = point(), d = point();
    const Eigen::Vector3d n = Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
    const auto residual = [&](const Pose& T) { return n.dot(T * x_cur - d); };
    const Row6<double> numeric = numericJacobian(residual, T_ref_cur);
    const Row6<double> exact = geometricJacobian<double>(T_ref_cur * x_cur, n);
    EXPECT_LT((exact - numeric).norm(), kRelative * numeric.norm());
  }
}

TEST_F(Residuals, photometricJacobianIsExact) {
  const AnalyticImage image;
  for (const CameraModel& camera :
       {CameraModel{525, 520, 319.5, 239.5, 640, 480}, CameraModel{481.2, -480, 319.5, 239.5, 640, 480}})
    for (int i = 0; i < 200; ++i) {
      const Pose T_ref_cur = pose();
      const Eigen::Vector3d p_ref = T_ref_cur * point();  // in front of the live camera
      const double grey_ref = uniform(0, 255);
      const auto residual = [&](const Pose& T) { return image.at(camera.project(T.inverse() * p_ref)) - grey_ref; };
      const Row6<double> numeric = numericJacobian(residual, T_ref_cur);
      const Eigen::Vector3d x_cur = T_ref_cur.inverse() * p_ref;
      const Eigen::Vector2d g = image.gradient(camera.project(x_cur));
      const Row6<double> exact =
          photometricJacobian<double>(p_ref, x_cur, T_ref_cur.rotationMatrix(), g.x(), g.y(), camera.fx, camera.fy);
      EXPECT_LT((exact - numeric).norm(), kRelative * numeric.norm());
    }
}

// The solver runs in single precision: the same formulas must hold there to its accuracy.
TEST_F(Residuals, singlePrecisionAgrees) {
  for (int i = 0; i < 50; ++i) {
    const Pose T_ref_cur = pose();
    const Eigen::Vector3d p_ref = T_ref_cur * point(), x_cur = T_ref_cur.inverse() * p_ref;
    const Row6<double> exact =
        photometricJacobian<double>(p_ref, x_cur, T_ref_cur.rotationMatrix(), 3.5, -7.25, 525, 525);
    const Row6<float> single = photometricJacobian<float>(
        p_ref.cast<float>(), x_cur.cast<float>(), T_ref_cur.rotationMatrix().cast<float>(), 3.5f, -7.25f, 525, 525);
    EXPECT_LT((exact - single.cast<double>()).norm(), 1e-5 * exact.norm());
  }
}

}  // namespace
}  // namespace comap
