#include "mapping_core/rgbd/alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

constexpr double kDegree = M_PI / 180;

Pyramid pyramidOf(const Frame& frame) {
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, 4, 0.3f, 6, pyramid);
  return pyramid;
}

// Two views of the room, 6 cm and 4 degrees apart, as two frames of one robot may be.
struct Pair {
  Pose T_world_ref, T_world_cur;
  Frame ref, cur;
  Pose truth() const { return T_world_ref.inverse() * T_world_cur; }
};

Pair makePair(const Scene& scene, double yaw_rad) {
  Pair pair;
  pair.T_world_ref =
      Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY())), Eigen::Vector3d(0.2, 0.1, -0.6));
  pair.T_world_cur = pair.T_world_ref * Pose::exp((Vector6d() << 0.05, -0.02, 0.03, 0.02, 0.06, -0.02).finished());
  pair.ref = scene.render(kinectCamera(), pair.T_world_ref);
  pair.cur = scene.render(kinectCamera(), pair.T_world_cur);
  return pair;
}

// 2 cm and 2 degrees off, in different directions.
Pose disturbance(int number) {
  static const Eigen::Vector3d kDirections[] = {{1, 0, 0},  {0, 1, 0},    {0, 0, 1},
                                                {1, -1, 1}, {-1, 1, 0.5}, {-1, -1, -1}};
  Vector6d twist;
  twist << 0.02 * kDirections[number].normalized(), 2 * kDegree * kDirections[5 - number].normalized();
  return Pose::exp(twist);
}

Alignment alignPair(const Frame& ref, const Frame& cur, const Pose& T_guess, int max_points = 6000) {
  ReferenceOptions reference;
  reference.max_points = max_points;
  PointResiduals workspace;
  const AlignmentOptions options;
  return align(buildReference(pyramidOf(ref), reference, options.noise), pyramidOf(cur), T_guess, options, workspace);
}

void expectFinite(const Alignment& a) {
  EXPECT_TRUE(a.T_ref_cur.isFinite());
  EXPECT_TRUE(a.information.allFinite());
  EXPECT_TRUE(a.weakest_direction.allFinite());
  for (const double number :
       {a.inlier_ratio, a.overlap, a.rms_sigma, a.degeneracy, a.photometric_median, a.gain, a.bias})
    EXPECT_TRUE(std::isfinite(number));
}

void expectConverges(const Pair& pair, double limit_m, double limit_rad) {
  const Alignment undisturbed = alignPair(pair.ref, pair.cur, pair.truth());
  for (int i = 0; i < 6; ++i) {
    const Alignment a = alignPair(pair.ref, pair.cur, disturbance(i) * pair.truth());
    const Pose error = pair.truth().inverse() * a.T_ref_cur;
    EXPECT_TRUE(a.solved);
    EXPECT_LT(error.translation().norm(), limit_m) << "disturbance " << i;
    EXPECT_LT(error.angle(), limit_rad) << "disturbance " << i;
    // What is left of the error is the method's own: every start ends at one place.
    EXPECT_LT((undisturbed.T_ref_cur.inverse() * a.T_ref_cur).translation().norm(), 1e-4) << "disturbance " << i;
    EXPECT_GT(a.degeneracy, 1e-3);
    EXPECT_GT(a.inlier_ratio, 0.5);
    EXPECT_LT(a.rms_sigma, 1.5);
    EXPECT_GT(a.overlap, 0.8);
  }
}

// Up to 0.9 mm remain on clean views whatever the start: reference points on silhouettes carry the gradient of one
// surface and the depth of the other. Without such points 0.2-0.4 mm remain.
TEST(Alignment, cleanViewsConverge) {
  for (const double yaw : {0.0, 2.1, 4.2}) {
    SCOPED_TRACE(yaw);
    expectConverges(makePair(Scene::room(), yaw), 0.0012, 0.03 * kDegree);
  }
}

TEST(Alignment, noisyViewsConverge) {
  for (const double yaw : {0.0, 2.1, 4.2}) {
    SCOPED_TRACE(yaw);
    Pair pair = makePair(Scene::room(), yaw);
    addKinectNoise(pair.ref, 1);
    addKinectNoise(pair.cur, 2);
    expectConverges(pair, 0.003, 0.15 * kDegree);
  }
}

TEST(Alignment, aViewAlignedToItselfStaysPut) {
  const Pair pair = makePair(Scene::room(), 0);
  const Alignment a = alignPair(pair.ref, pair.ref, Pose());
  EXPECT_LT(a.T_ref_cur.translation().norm(), 5e-5);
  EXPECT_LT(a.T_ref_cur.angle(), 5e-5);
  EXPECT_LT(a.photometric_median, 0.5);
  EXPECT_GT(a.inlier_ratio, 0.99);
}

// On a bare wall two translations and one rotation cannot be seen; the guess must survive in them.
TEST(Alignment, aBarePlaneIsReportedAndItsFreeDirectionsKeepTheGuess) {
  const Frame wall = Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(kinectCamera(), Pose());
  Vector6d unseen, seen;
  unseen << 0.02, -0.015, 0, 0, 0, 2 * kDegree;
  seen << 0, 0, 0.015, 1 * kDegree, -1.5 * kDegree, 0;
  const Alignment a = alignPair(wall, wall, Pose::exp(unseen + seen));
  ASSERT_TRUE(a.solved);
  expectFinite(a);
  EXPECT_LT(a.degeneracy, 1e-4);
  const Vector6d left = a.T_ref_cur.log();
  EXPECT_LT(std::abs(left(2)), 0.0003) << "towards the wall is seen";
  EXPECT_LT(std::hypot(left(3), left(4)), 0.03 * kDegree) << "tilt is seen";
  EXPECT_LT(std::hypot(left(0) - unseen(0), left(1) - unseen(1)), 0.002) << "along the wall is not";
  EXPECT_LT(std::abs(left(5) - unseen(5)), 0.1 * kDegree) << "nor the turn about its normal";
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(a.information);
  EXPECT_LT(eigen.eigenvalues()(2), 2e-4 * eigen.eigenvalues()(5)) << "three directions without information";
  EXPECT_GT(eigen.eigenvalues()(3), 1e-3 * eigen.eigenvalues()(5)) << "and only three";
}

TEST(Alignment, aBlackFrameStillAlignsByShape) {
  Pair pair = makePair(Scene::room(), 0);
  pair.cur.colour = ColourImage(pair.cur.camera.width, pair.cur.camera.height);
  const Alignment a = alignPair(pair.ref, pair.cur, disturbance(3) * pair.truth());
  expectFinite(a);
  EXPECT_TRUE(a.solved);
  EXPECT_GT(a.photometric_median, 5) << "the colour does not agree, and that shows";
}

TEST(Alignment, withoutDepthNothingIsSolvedAndTheGuessStays) {
  Pair pair = makePair(Scene::room(), 0);
  const Frame whole = pair.cur;
  pair.cur.depth = DepthImage(pair.cur.camera.width, pair.cur.camera.height);
  const Pose guess = disturbance(2);
  for (const Alignment& a : {alignPair(pair.ref, pair.cur, guess), alignPair(pair.cur, whole, guess),
                             alignPair(pair.cur, pair.cur, guess)}) {
    expectFinite(a);
    EXPECT_FALSE(a.solved);
    EXPECT_LT((a.T_ref_cur.matrix() - guess.matrix()).norm(), 1e-12);
    EXPECT_TRUE(a.information.isZero());
  }
}

TEST(Alignment, viewsThatShareNothingAreNotSolvedOrSaySo) {
  const Pair pair = makePair(Scene::room(), 0);
  const Pose away(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())), {0, 0, 0});
  const Alignment a = alignPair(pair.ref, pair.cur, away);
  expectFinite(a);
  EXPECT_FALSE(a.solved);
}

TEST(Alignment, anotherExposureIsAbsorbed) {
  for (const auto& [gain, bias] : {std::pair{0.75, 12.0}, std::pair{1.2, -15.0}}) {
    Pair pair = makePair(Scene::room(), 0);
    changeExposure(pair.cur, gain, bias);
    const Alignment a = alignPair(pair.ref, pair.cur, disturbance(4) * pair.truth());
    const Pose error = pair.truth().inverse() * a.T_ref_cur;
    EXPECT_LT(error.translation().norm(), 0.001);
    EXPECT_LT(error.angle(), 0.05 * kDegree);
    EXPECT_NEAR(a.gain, gain, 0.1);
    EXPECT_NEAR(a.gain * 112 + a.bias, gain * 112 + bias, 3) << "at the mean grey";
    EXPECT_LT(a.photometric_median, 3);
  }
}

TEST(Alignment, informationIsSymmetricAndPositive) {
  const Pair pair = makePair(Scene::room(), 2.1);
  const Alignment a = alignPair(pair.ref, pair.cur, pair.truth());
  EXPECT_LT((a.information - a.information.transpose()).norm(), 1e-12 * a.information.norm());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(a.information);
  EXPECT_GT(eigen.eigenvalues()(0), 0);
  EXPECT_NEAR(a.weakest_direction.norm(), 1, 1e-9);
}

TEST(Alignment, qualityDoesNotDependOnTheNumberOfPoints) {
  Pair pair = makePair(Scene::room(), 0);
  addKinectNoise(pair.ref, 3);
  addKinectNoise(pair.cur, 4);
  const Alignment few = alignPair(pair.ref, pair.cur, pair.truth(), 2000);
  const Alignment many = alignPair(pair.ref, pair.cur, pair.truth(), 6000);
  EXPECT_NEAR(few.rms_sigma / many.rms_sigma, 1, 0.15);
  EXPECT_NEAR(few.inlier_ratio / many.inlier_ratio, 1, 0.1);
  EXPECT_NEAR(few.overlap, many.overlap, 0.05);
  EXPECT_LT(std::abs(std::log(few.degeneracy / many.degeneracy)), std::log(1.5));
  // The information does: it counts what was measured.
  EXPECT_GT(many.information.trace(), 1.5 * few.information.trace());
}

TEST(Alignment, theSameInputGivesTheSameBits) {
  const Pair pair = makePair(Scene::room(), 0);
  const Pose guess = disturbance(1) * pair.truth();
  const Alignment a = alignPair(pair.ref, pair.cur, guess), b = alignPair(pair.ref, pair.cur, guess);
  EXPECT_EQ(a.T_ref_cur.matrix(), b.T_ref_cur.matrix());
  EXPECT_EQ(a.information, b.information);
}

}  // namespace
}  // namespace comap
