#include "fleet_tools/evaluate/metrics_surface.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

// A floor of 1 m x 1 m at z = 0, one point per centimetre, normals up.
PlyPoints floorTruth() {
  PlyPoints points;
  for (int y = 0; y <= 100; ++y) {
    for (int x = 0; x <= 100; ++x) {
      points.positions.emplace_back(0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0.0f);
      points.normals.emplace_back(0.0f, 0.0f, 1.0f);
    }
  }
  return points;
}

TEST(Surface, WithinReachItIsPointToPlane) {
  // Between four truth points and 3 mm above: the plain distance is sqrt(5^2 + 5^2 + 3^2) = 7.68 mm.
  PlyPoints map;
  map.positions = {{0.505f, 0.505f, 0.003f}};
  const auto score = scoreSurface(map, Pose(), floorTruth(), 1);
  EXPECT_NEAR(score.accuracy_mean_m, 0.003, 1e-6);
  EXPECT_NEAR(score.point_mean_m, 0.00768115, 1e-6);
}

TEST(Surface, BeyondReachItIsTheDistance) {
  PlyPoints map;
  map.positions = {{-0.3f, 0.5f, 0.0f}, {0.5f, 0.5f, 0.04f}};  // beside the floor, in its plane; and 4 cm above
  const auto score = scoreSurface(map, Pose(), floorTruth(), 1);
  EXPECT_NEAR(score.accuracy_mean_m, 0.5 * (0.3 + 0.04), 1e-6);
  EXPECT_NEAR(score.accuracy_median_m, 0.17, 1e-6);
}

TEST(Surface, WithoutNormalsItIsTheDistance) {
  PlyPoints map, truth = floorTruth();
  truth.normals.clear();
  map.positions = {{0.505f, 0.505f, 0.003f}};
  EXPECT_NEAR(scoreSurface(map, Pose(), truth, 1).accuracy_mean_m, 0.00768115, 1e-6);
}

TEST(Surface, MeanAndMedianOfKnownOffsets) {
  PlyPoints map;
  for (const float z : {0.001f, -0.002f, 0.009f}) map.positions.emplace_back(0.5f, 0.5f, z);
  const auto score = scoreSurface(map, Pose(), floorTruth(), 2);
  EXPECT_NEAR(score.accuracy_mean_m, 0.004, 1e-6);
  EXPECT_NEAR(score.accuracy_median_m, 0.002, 1e-6);
}

TEST(Surface, TheMapIsAlignedFirst) {
  const Pose T_truth_map(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                         Eigen::Vector3d(1, -2, 0.5));
  PlyPoints map;
  map.positions = {(T_truth_map.inverse() * Eigen::Vector3d(0.5, 0.5, 0.003)).cast<float>()};
  EXPECT_NEAR(scoreSurface(map, T_truth_map, floorTruth(), 1).accuracy_mean_m, 0.003, 1e-6);
}

TEST(Surface, CompletenessIsTheShareOfTruthCovered) {
  // The map covers x <= 0.5 with a point each 5 mm. Truth up to x = 0.52 lies within 2 cm: 53 of 101 columns.
  PlyPoints map;
  for (int y = 0; y <= 200; ++y) {
    for (int x = 0; x <= 100; ++x) {
      map.positions.emplace_back(0.005f * static_cast<float>(x), 0.005f * static_cast<float>(y), 0.0f);
    }
  }
  // The last column is exactly at 2 cm, where rounding decides.
  EXPECT_NEAR(scoreSurface(map, Pose(), floorTruth(), 2).completeness_2cm, 52.5 / 101, 0.5 / 101 + 1e-6);
}

}  // namespace
}  // namespace comap
