#include "fleet_tools/evaluate/metrics_doubles.h"

#include <gtest/gtest.h>

#include "fleet_tools/evaluate/metrics_surface.h"
#include "fleet_tools/evaluate/surface_seen.h"

namespace comap {
namespace {

// A square of 1 m at height z, 101 x 101 points that face along -z.
void addWall(PlyPoints& points, float z, float share = 1) {
  for (int y = 0; y <= 100; ++y) {
    for (int x = 0; x < static_cast<int>(101 * share); ++x) {
      points.positions.emplace_back(0.01f * static_cast<float>(x) - 0.5f, 0.01f * static_cast<float>(y) - 0.5f, z);
      points.normals.emplace_back(0, 0, -1);
      points.radii.push_back(0.008f);
    }
  }
}

TEST(FindDoubles, CountsWhatLiesOneToThreeCentimetresBehind) {
  PlyPoints points;
  addWall(points, 2.0f);
  EXPECT_EQ(findDoubles(points, 2).share(), 0);
  addWall(points, 2.02f);
  EXPECT_NEAR(findDoubles(points, 2).share(), 0.5, 1e-9);  // the one behind, not the one in front
  EXPECT_EQ(findDoubles(points, 1).doubled, findDoubles(points, 3).doubled);
}

TEST(FindDoubles, NoiseAndOtherSurfacesAreNone) {
  for (const float behind : {0.005f, 0.04f}) {
    PlyPoints points;
    addWall(points, 2.0f);
    addWall(points, 2.0f + behind);
    EXPECT_EQ(findDoubles(points, 2).doubled, 0u) << behind;
  }
  PlyPoints board;  // its back faces away
  addWall(board, 2.0f);
  addWall(board, 2.02f);
  for (size_t i = board.normals.size() / 2; i < board.normals.size(); ++i) board.normals[i] = -board.normals[i];
  EXPECT_EQ(findDoubles(board, 2).doubled, 0u);
}

TEST(SurfaceSeen, MarksWhatADepthImageMeasured) {
  PlyPoints points;
  addWall(points, 2.0f);
  const CameraModel camera{100, 100, 49.5, 49.5, 100, 100};
  DepthImage depth(100, 100, 10000);  // 2 m
  for (int v = 0; v < 100; ++v) {
    for (int u = 0; u < 50; ++u)
      depth.at(u, v) = static_cast<uint16_t>(v < 50 ? 0 : 7500);  // nothing, or something before it
  }
  SurfaceSeen seen(points.positions);
  seen.add(camera, depth, Pose(), 2);
  size_t marked = 0;
  for (size_t i = 0; i < points.positions.size(); ++i) {
    marked += seen.seen()[i];
    if (seen.seen()[i]) {
      EXPECT_GT(points.positions[i].x(), -0.01f);
    }
  }
  EXPECT_NEAR(static_cast<double>(marked), static_cast<double>(points.positions.size()) / 2, 110);

  // Half of the truth seen, and of the seen half the left fifth missing in the map.
  PlyPoints map;
  for (size_t i = 0; i < points.positions.size(); ++i) {
    if (points.positions[i].x() < 0.1f) continue;
    map.positions.push_back(points.positions[i]);
    map.normals.push_back(points.normals[i]);
    map.radii.push_back(0.008f);
  }
  const auto score = scoreSurface(map, Pose(), points, 2, seen.seen());
  EXPECT_EQ(score.truth_points_seen, marked);
  EXPECT_NEAR(score.completeness_2cm, 0.42, 0.02);       // reached from 2 cm away
  EXPECT_NEAR(score.completeness_seen_2cm, 0.82, 0.03);  // 41 or 42 of 51 columns
  EXPECT_GE(score.covered_seen_2cm, score.completeness_seen_2cm);
}

}  // namespace
}  // namespace comap
