#include "mapping_core/rgbd/point_residuals.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "mapping_core/rgbd/constraints.h"
#include "mapping_core/rgbd/residuals.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

const Pose kT_ref_cur = Pose::exp((Vector6d() << 0.02, -0.01, 0.015, 0.01, -0.008, 0.005).finished());

struct Pair {
  ReferenceView reference;
  Pyramid frame;
};

Pair pairOf(const Scene& scene, bool with_noise = false) {
  Pair pair;
  Pyramid pyramid;
  Frame first = scene.render(kinectCamera(), Pose()), second = scene.render(kinectCamera(), kT_ref_cur);
  if (with_noise) {
    addKinectNoise(first, 1);
    addKinectNoise(second, 2);
  }
  buildPyramid(first.colour, first.depth, first.camera, 3, 0.3f, 6, pyramid);
  buildPyramid(second.colour, second.depth, second.camera, 3, 0.3f, 6, pair.frame);
  pair.reference = buildReference(pyramid, {1, 2, 6000}, {});
  return pair;
}

// One point by the book: what the vectorised loop must arrive at.
struct Expected {
  double rg = 0, wg = 0, rp = 0, wp = 0;
  Row6<double> jg = Row6<double>::Zero(), jp = Row6<double>::Zero();
};

Expected evaluateOne(const ReferencePoints& points, size_t i, const PyramidLevel& frame, const Pose& T_ref_cur,
                     const AssociationGates& gates, const DepthNoiseModel& noise) {
  Expected e;
  const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]), n(points.nx[i], points.ny[i], points.nz[i]);
  const Eigen::Vector3d q = T_ref_cur.inverse() * p;
  if (q.z() < 0.05) return e;
  const Eigen::Vector2d uv = frame.camera.project(q);
  const double u = uv.x(), v = uv.y();
  if (!(u >= 1 && v >= 1 && u <= frame.grey.width() - 2.001 && v <= frame.grey.height() - 2.001)) return e;
  const int un = static_cast<int>(u + 0.5), vn = static_cast<int>(v + 0.5);
  const double d = frame.depth_m.at(un, vn);
  if (d <= 0) return e;
  const double live = noise.floor_m + noise.factor_per_m * d * d;
  const Eigen::Vector3d x_ref = T_ref_cur * frame.camera.unproject(un, vn, d);
  if (n.norm() > 0.5 && (x_ref - p).norm() < gates.distance_m) {
    const double along = n.dot(x_ref) / x_ref.norm();
    const double sigma = std::sqrt(points.sigma_m[i] * points.sigma_m[i] + along * along * live * live +
                                   gates.extra_sigma_m * gates.extra_sigma_m);
    const double r = n.dot(x_ref - p) / sigma, share = r / gates.tukey_sigma;
    if (std::abs(share) < 1) {
      e.rg = r;
      e.wg = std::pow(1 - share * share, 2);
      e.jg = geometricJacobian<double>(x_ref, n) / sigma;
    }
  }
  const double brightness_m =
      gates.photometric_m > 0
          ? gates.photometric_m
          : std::max(0.03, gates.photometric_sigma * (live + points.sigma_m[i] + gates.extra_sigma_m));
  if (std::abs(d - q.z()) >= brightness_m) return e;
  const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
  const double a = u - u0, b = v - v0;
  const double i00 = frame.grey.at(u0, v0), i10 = frame.grey.at(u0 + 1, v0);
  const double i01 = frame.grey.at(u0, v0 + 1), i11 = frame.grey.at(u0 + 1, v0 + 1);
  e.rp = (1 - b) * ((1 - a) * i00 + a * i10) + b * ((1 - a) * i01 + a * i11) - points.grey[i];
  const double gx = (1 - b) * (i10 - i00) + b * (i11 - i01), gy = (1 - a) * (i01 - i00) + a * (i11 - i10);
  e.wp = 1;
  e.jp = photometricJacobian<double>(p, q, T_ref_cur.rotationMatrix(), gx, gy, frame.camera.fx, frame.camera.fy);
  return e;
}

void expectAgreement(const AssociationGates& gates) {
  const Pair pair = pairOf(Scene::room(), true);
  const DepthNoiseModel noise;
  PointResiduals residuals;
  for (const ReferencePoints& points : pair.reference.levels) {
    const PyramidLevel& frame = pair.frame[static_cast<size_t>(points.level)];
    const ResidualCounts counts = evaluateResiduals(points, frame, kT_ref_cur, gates, {}, noise, residuals);
    size_t inliers = 0, photometric = 0, differ = 0;
    for (size_t i = 0; i < points.x.size(); ++i) {
      const Expected e = evaluateOne(points, i, frame, kT_ref_cur, gates, noise);
      inliers += e.wg > 0;
      photometric += e.wp > 0;
      // A point that rounds to the other pixel, or lies on a gate, may differ.
      if (std::abs(e.rg - residuals.rg[i]) > 0.01 || (e.wp > 0) != (residuals.wp[i] > 0)) {
        ++differ;
        continue;
      }
      EXPECT_NEAR(residuals.wg[i], e.wg, 0.01);
      EXPECT_NEAR(residuals.rp[i], e.rp, 0.05);
      for (int c = 0; c < 6; ++c) {
        EXPECT_NEAR(residuals.jg[c][i], e.jg(c), 1e-3 * (1 + e.jg.norm()));
        EXPECT_NEAR(residuals.jp[c][i], e.jp(c), 1e-2 * (1 + e.jp.norm()));
      }
    }
    EXPECT_LE(differ, points.count / 200);
    EXPECT_NEAR(static_cast<double>(counts.inliers), static_cast<double>(inliers),
                0.005 * static_cast<double>(inliers));
    EXPECT_NEAR(static_cast<double>(counts.photometric), static_cast<double>(photometric),
                0.005 * static_cast<double>(photometric));
    EXPECT_GT(inliers, points.count / 2);
  }
}

TEST(PointResiduals, agreeWithOnePointAfterTheOther) { expectAgreement({}); }

TEST(PointResiduals, agreeWhereSigmaIsAddedAndTheBrightnessGateIsFixed) {
  AssociationGates gates;
  gates.extra_sigma_m = 0.02f;
  gates.photometric_m = 0.01f;
  expectAgreement(gates);
}

TEST(PointResiduals, aFixedBrightnessGateLetsOnlyThatMuchDepthDiffer) {
  const Pair pair = pairOf(Scene::room(), true);
  const ReferencePoints& points = pair.reference.levels.back();
  PointResiduals residuals;
  AssociationGates gates;
  gates.extra_sigma_m = 0.02f;
  const size_t by_noise = evaluateResiduals(points, pair.frame[1], kT_ref_cur, gates, {}, {}, residuals).photometric;
  gates.photometric_m = 0.07f;
  const size_t at_7_cm = evaluateResiduals(points, pair.frame[1], kT_ref_cur, gates, {}, {}, residuals).photometric;
  gates.photometric_m = 0.002f;
  const size_t at_2_mm = evaluateResiduals(points, pair.frame[1], kT_ref_cur, gates, {}, {}, residuals).photometric;
  EXPECT_LT(at_2_mm, at_7_cm);
  EXPECT_LE(at_7_cm, by_noise);
}

TEST(PointResiduals, normalEquationsAreTheSumOfTheRows) {
  const Pair pair = pairOf(Scene::room());
  const ReferencePoints& points = pair.reference.levels.back();
  PointResiduals residuals;
  evaluateResiduals(points, pair.frame[1], kT_ref_cur, {}, {}, {}, residuals);
  const NormalEquations sums = sumNormalEquations(points.x.size(), residuals);
  Matrix6d a = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (size_t i = 0; i < points.x.size(); ++i) {
    Vector6d g, p;
    for (int c = 0; c < 6; ++c) {
      g(c) = residuals.jg[c][i];
      p(c) = residuals.jp[c][i];
    }
    a += residuals.wg[i] * g * g.transpose() + residuals.wp[i] * p * p.transpose();
    b += residuals.wg[i] * residuals.rg[i] * g + residuals.wp[i] * residuals.rp[i] * p;
  }
  EXPECT_LT((sums.a - a).norm(), 1e-4 * a.norm());
  EXPECT_LT((sums.b - b).norm(), 1e-3 * b.norm() + 1e-3);
}

TEST(PointResiduals, aGradientThatOneViewShowsAloneIsNoise) {
  PointResiduals residuals;
  residuals.reserve(8);
  residuals.wp.assign(8, 1);
  residuals.rp.assign(8, 0);
  residuals.gradient = {-5, 0, 9, 10, 11, 20, 100, 1000};
  weighPhotometric(8, {1, 1.345f, 1, 10}, residuals);
  for (const size_t none : {0u, 1u, 2u, 3u}) EXPECT_EQ(residuals.wp[none], 0) << none;
  EXPECT_NEAR(residuals.wp[4], 1.0 / 11, 1e-6);
  EXPECT_NEAR(residuals.wp[5], 0.5, 1e-6);
  EXPECT_NEAR(residuals.wp[7], 0.99, 1e-6);
}

double weakest(const Matrix6d& a) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(a);
  return eigen.eigenvalues()(2) / eigen.eigenvalues()(5);
}

// Normals that noise has tilted hold nothing; what two views share of them is near zero.
TEST(Constraints, noiseOnAWallHoldsNothing) {
  const Pair pair = pairOf(Scene::plainPlane({0, 0, 2}, {0, 0, -1}), true);
  const ReferencePoints& points = pair.reference.levels.back();
  PointResiduals residuals;
  evaluateResiduals(points, pair.frame[1], kT_ref_cur, {}, {}, {}, residuals);
  residuals.wp.assign(residuals.wp.size(), 0);
  const Matrix6d shared = sumConstraints(points, pair.frame[1], kT_ref_cur, {}, 0, residuals);
  const Matrix6d naive = sumNormalEquations(points.x.size(), residuals).a;
  EXPECT_LT(weakest(shared), 0.2 * weakest(naive));
}

TEST(Constraints, ofACleanRoomAreThoseOfTheNormalEquations) {
  const Pair pair = pairOf(Scene::room());
  const ReferencePoints& points = pair.reference.levels.back();
  PointResiduals residuals;
  evaluateResiduals(points, pair.frame[1], kT_ref_cur, {}, {}, {}, residuals);
  residuals.wp.assign(residuals.wp.size(), 0);
  const Matrix6d shared = sumConstraints(points, pair.frame[1], kT_ref_cur, {}, 0, residuals);
  const Matrix6d naive = sumNormalEquations(points.x.size(), residuals).a;
  EXPECT_LT((shared - naive).norm(), 0.1 * naive.norm());
}

}  // namespace
}  // namespace comap
