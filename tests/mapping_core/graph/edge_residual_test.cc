#include "mapping_core/graph/edge_residual.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>
#include <random>

#include "mapping_core/graph/edge_information.h"
#include "mapping_core/graph/loop_weights.h"

namespace comap {
namespace {

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  Vector6d normal6() {
    Vector6d v;
    for (int i = 0; i < 6; ++i) v(i) = normal_(engine_);
    return v;
  }
  Pose pose(double metres, double radians) {
    Vector6d v = normal6();
    v.head<3>() *= metres;
    v.tail<3>() *= radians;
    return Pose::exp(v);
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

Matrix6d randomCovariance(Dice& dice) {
  Matrix6d a;
  for (int i = 0; i < 6; ++i) a.col(i) = dice.normal6();
  Vector6d sigma;
  sigma << 0.02, 0.005, 0.01, 0.004, 0.01, 0.002;
  return sigma.asDiagonal() * Matrix6d(a * a.transpose() / 6 + 0.1 * Matrix6d::Identity()) * sigma.asDiagonal();
}

TEST(EdgeResidual, jacobiansAgreeWithCentralDifferences) {
  Dice dice(1);
  for (int round = 0; round < 300; ++round) {
    const double angle = round % 3 == 0 ? 1e-3 : round % 3 == 1 ? 0.03 : 0.7;  // both branches of the series
    const Pose a = dice.pose(3, 0.8), b = dice.pose(3, 0.8);
    const Pose z = dice.pose(0.5, angle) * a.inverse() * b;
    const EdgeResidual edge = edgeResidual(a, b, z);
    if (edge.increment.tail<3>().norm() > 2.8) continue;  // log folds over at pi
    Matrix6d from, to;
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 6; ++i) {
      const Vector6d d = kStep * Vector6d::Unit(i);
      from.col(i) = (edgeIncrement(a * Pose::exp(d), b, z) - edgeIncrement(a * Pose::exp(-d), b, z)) / (2 * kStep);
      to.col(i) = (edgeIncrement(a, b * Pose::exp(d), z) - edgeIncrement(a, b * Pose::exp(-d), z)) / (2 * kStep);
    }
    EXPECT_LT((from - edge.d_from).norm() / from.norm(), 1e-5) << "round " << round;
    EXPECT_LT((to - edge.d_to).norm() / to.norm(), 1e-5) << "round " << round;
  }
}

TEST(EdgeResidual, whitenedResidualOfDrawnNoiseHasUnitVariance) {
  Dice dice(2);
  const Pose a = dice.pose(2, 1), b = dice.pose(2, 1);
  const Pose truth = a.inverse() * b;
  ASSERT_GT(truth.translation().norm(), 1.0);  // a long lever: the wrong side would show
  const Matrix6d covariance = randomCovariance(dice);
  const Matrix6d root_covariance = covariance.llt().matrixL();
  const Result<Matrix6d> root = squareRootInformation(covariance.inverse(), 0, 0);
  ASSERT_TRUE(root) << root.error().text;

  constexpr int kDraws = 20000;
  double left = 0, right = 0;
  Matrix6d second_moment = Matrix6d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Pose z = Pose::exp(root_covariance * dice.normal6()) * truth;
    const Vector6d white = *root * edgeIncrement(a, b, z);
    second_moment += white * white.transpose() / kDraws;
    left += white.squaredNorm() / kDraws;
    right += (*root * (z.inverse() * truth).log()).squaredNorm() / kDraws;
  }
  EXPECT_NEAR(left / 6, 1.0, 0.02);
  EXPECT_LT((second_moment - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_GT(right / 6, 2.0) << "the test would not tell the sides apart";
}

TEST(EdgeInformation, floorAddsToTheCovariance) {
  Dice dice(3);
  for (int round = 0; round < 50; ++round) {
    const Matrix6d covariance = randomCovariance(dice);
    const Result<Matrix6d> root = squareRootInformation(covariance.inverse(), 0.03, 0.01);
    ASSERT_TRUE(root);
    Vector6d floor;
    floor << 9e-4, 9e-4, 9e-4, 1e-4, 1e-4, 1e-4;
    const Matrix6d expected = (covariance + Matrix6d(floor.asDiagonal())).inverse();
    EXPECT_LT((root->transpose() * *root - expected).norm() / expected.norm(), 1e-9);
  }
}

TEST(EdgeInformation, nothingIsBetterKnownThanTheFloorAndUnknownStaysUnknown) {
  Matrix6d information = Matrix6d::Zero();
  information(0, 0) = 1e14;
  information(5, 5) = 1e14;
  const Result<Matrix6d> root = squareRootInformation(information, 0.002, 0.0005);
  ASSERT_TRUE(root);
  const Matrix6d limited = root->transpose() * *root;
  EXPECT_NEAR(limited(0, 0) * 0.002 * 0.002, 1, 1e-6);
  EXPECT_NEAR(limited(5, 5) * 0.0005 * 0.0005, 1, 1e-6);
  EXPECT_EQ(limited(1, 1), 0);
  EXPECT_EQ(limited(4, 4), 0);
}

TEST(EdgeInformation, refusesWhatIsNoInformation) {
  Matrix6d bad = Matrix6d::Identity();
  bad(2, 2) = -1;
  EXPECT_EQ(squareRootInformation(bad, 0.002, 0.0005).error().code, ErrorCode::kBadData);
  bad = Matrix6d::Identity();
  bad(1, 3) = 0.5;
  EXPECT_NE(squareRootInformation(bad, 0.002, 0.0005).error().text.find("symmetric"), std::string::npos);
  bad(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(squareRootInformation(bad, 0.002, 0.0005).error().text.find("finite"), std::string::npos);
}

TEST(LoopWeights, fallWithTheResidualAndSharpenToTheGate) {
  constexpr double kGate = 16.8;
  const std::vector<double> chi2 = {1, 5, 40, 5000};
  double mu = initialSharpness(chi2, kGate);
  ASSERT_GT(mu, 0);
  EXPECT_GT(loopWeight(5000, kGate, mu), 0) << "the worst edge still pulls at first";
  for (int i = 0; i < 60; ++i, mu *= kSharpening) {
    double last = 1;
    for (double value = 0.1; value < 1e5; value *= 1.1) {
      const double weight = loopWeight(value, kGate, mu);
      ASSERT_GE(weight, 0);
      ASSERT_LE(weight, last + 1e-12) << "chi2 " << value << " mu " << mu;
      last = weight;
    }
  }
  EXPECT_EQ(loopWeight(0.99 * kGate, kGate, mu), 1);
  EXPECT_EQ(loopWeight(1.01 * kGate, kGate, mu), 0);
  EXPECT_LE(initialSharpness(std::vector<double>{1, 2, 8}, kGate), 0) << "nothing to reject";
}

TEST(EdgeInformation, closuresAreKnownLessWellThanTheirInformationSays) {
  Edge edge;
  edge.information = Matrix6d::Identity() * 100;
  GraphOptions options;
  options.closure_sigma = 4;
  for (const EdgeKind kind : {EdgeKind::kOdometry, EdgeKind::kCovisibility, EdgeKind::kLoop, EdgeKind::kInterRobot}) {
    edge.kind = kind;
    const Result<Matrix6d> root = squareRootInformation(edge, options);
    ASSERT_TRUE(root);
    const bool closure = kind == EdgeKind::kLoop || kind == EdgeKind::kInterRobot;
    EXPECT_NEAR(std::abs(root->determinant()), std::pow(closure ? 10.0 / 4 : 10.0, 6), closure ? 0.5 : 2e3);
  }
}

TEST(EdgeResidual, PullsBackAsItsJacobianDoes) {
  std::mt19937 engine(9);
  std::normal_distribution<double> noise;
  for (const double size : {0.0, 1e-4, 0.01, 0.3}) {
    Vector6d twist, pull;
    for (int i = 0; i < 6; ++i) twist(i) = size * noise(engine), pull(i) = noise(engine);
    EXPECT_LT((pulledBack(twist, pull) - inverseLeftJacobian(twist).transpose() * pull).norm(), 1e-7 * pull.norm());
  }
}

}  // namespace
}  // namespace comap
