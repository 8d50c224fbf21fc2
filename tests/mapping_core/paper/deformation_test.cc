// The deformation graph by itself: it recovers bends it is told of, and does nothing when told nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mapping_core/paper/deformation_solver.h"
#include "mapping_core/paper/map_deformation.h"
#include "mapping_core/surfels/surfel_pool.h"
#include "tests/mapping_core/gpu/test_device.h"

namespace comap {
namespace {

// Points along a walk of ten metres, one a tick, spread half a metre about it.
std::vector<TimedPoint> walk(uint32_t count, uint32_t camera = 0) {
  std::vector<TimedPoint> points;
  for (uint32_t i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) / count;
    points.push_back({{10 * s, 0.5 * std::sin(37.0 * i), 0.5 * std::cos(61.0 * i)}, {camera, i + 1}});
  }
  return points;
}

std::vector<TimedPoint> every(const std::vector<TimedPoint>& points, size_t stride) {
  std::vector<TimedPoint> some;
  for (size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
  return some;
}

// A bend of up to 10 cm that grows smoothly along the walk.
Eigen::Vector3d bent(const Eigen::Vector3d& x) {
  const double angle = 0.01 * x.x() / 10;
  return {x.x() - angle * x.y(), x.y() + angle * x.x() / 2 + 0.02 * std::sin(x.x() / 4), x.z() + 0.001 * x.x() * x.x()};
}

// How far the graph leaves points from where the bend has them.
std::vector<double> missesOf(const DeformationGraph& graph, const std::vector<TimedPoint>& points) {
  std::vector<double> misses;
  for (const TimedPoint& point : points)
    misses.push_back(
        (point.position + graph.shift(graph.influence(point), point.position) - bent(point.position)).norm());
  std::sort(misses.begin(), misses.end());
  return misses;
}

TEST(DeformationGraph, RecoversASmoothDeformationOfAThousandPoints) {
  const auto points = walk(1000);
  DeformationGraph graph(every(points, 10), NodeOrder::kTime);
  std::vector<DeformationConstraint> constraints;
  for (const TimedPoint& point : points) constraints.push_back({point, {bent(point.position), point.time}});
  const DeformationSolve solved = solveDeformation(graph, constraints, {});
  ASSERT_TRUE(solved.solved);
  EXPECT_GT(solved.start_error_m, 0.02);
  EXPECT_LT(solved.mean_error_m, 3e-4);
  EXPECT_LT(missesOf(graph, points).back(), 1e-3);
}

TEST(DeformationGraph, PointsBetweenTheConstraintsFollow) {
  const auto points = walk(1000);
  DeformationGraph graph(every(points, 10), NodeOrder::kTime);
  std::vector<DeformationConstraint> constraints;
  for (const TimedPoint& point : every(points, 2)) constraints.push_back({point, {bent(point.position), point.time}});
  ASSERT_TRUE(solveDeformation(graph, constraints, {}).solved);
  const auto misses = missesOf(graph, points);
  EXPECT_LT(misses[misses.size() / 2], 3e-4);
  EXPECT_LT(misses.back(), 2e-3);
}

TEST(DeformationGraph, FrozenNodesStay) {
  const auto points = walk(400);
  DeformationGraph graph(every(points, 10), NodeOrder::kTime);
  std::vector<bool> frozen(graph.nodes().size());
  for (size_t n = 0; n < frozen.size(); ++n) frozen[n] = graph.nodes()[n].time.tick <= 200;
  std::vector<DeformationConstraint> constraints;
  for (const TimedPoint& point : points)
    if (point.time.tick > 350)
      constraints.push_back({point, {point.position + Eigen::Vector3d(0, 0.1, 0), point.time}});
  ASSERT_TRUE(solveDeformation(graph, constraints, frozen).solved);
  for (size_t n = 0; n < frozen.size(); ++n)
    if (frozen[n]) {
      EXPECT_EQ(graph.nodes()[n].A, Eigen::Matrix3d::Identity());
      EXPECT_EQ(graph.nodes()[n].b, Eigen::Vector3d::Zero());
    }
  const TimedPoint& last = points.back();
  EXPECT_NEAR(graph.shift(graph.influence(last), last.position).y(), 0.1, 0.005);
}

TEST(DeformationGraph, RelativeTiesMoveBothEnds) {
  const auto points = walk(400);
  DeformationGraph graph(every(points, 10), NodeOrder::kTime);
  std::vector<DeformationConstraint> constraints;
  for (size_t i = 300; i < 400; ++i)
    constraints.push_back({points[i], {points[i].position + Eigen::Vector3d(0, 0.1, 0), points[i].time}});
  // Two points of one place at two times: the early one has to come along.
  DeformationConstraint tie{points[350], points[50]};
  tie.target.position = tie.source.position;
  tie.relative = true;
  constraints.push_back(tie);
  ASSERT_TRUE(solveDeformation(graph, constraints, {}).solved);
  const Eigen::Vector3d source = graph.shift(graph.influence(tie.source), tie.source.position);
  const Eigen::Vector3d target = graph.shift(graph.influence(tie.target), tie.target.position);
  EXPECT_LT((source - target).norm(), 0.01);
}

TEST(DeformationGraph, ByCameraOnlyItsOwnNodesCount) {
  auto points = walk(200, 0);
  const auto others = walk(200, 1);
  points.insert(points.end(), others.begin(), others.end());
  const DeformationGraph by_camera(every(points, 5), NodeOrder::kCameraTime);
  const DeformationGraph by_time(every(points, 5), NodeOrder::kTime);
  size_t mixed = 0;
  for (const TimedPoint& point : points) {
    const Influence own = by_camera.influence(point), any = by_time.influence(point);
    for (size_t i = 0; i < own.count; ++i) EXPECT_EQ(by_camera.nodes()[own.nodes[i]].time.camera, point.time.camera);
    for (size_t i = 0; i < any.count; ++i) mixed += by_time.nodes()[any.nodes[i]].time.camera != point.time.camera;
  }
  EXPECT_GT(mixed, 0u) << "the published order mixes cameras";
  for (uint32_t n = 0; n < by_camera.nodes().size(); ++n)
    for (const uint32_t other : by_camera.neighbours()[n])
      EXPECT_EQ(by_camera.nodes()[n].time.camera, by_camera.nodes()[other].time.camera);
}

TEST(MapDeformation, IdentityConstraintsLeaveTheMapBitIdentical) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto pool = SurfelPool::create(device, 0, true);
  ASSERT_TRUE(pool);
  TimedSurfelMap map(*pool, {});
  std::vector<FrameTime> owners;
  for (uint32_t tick = 1; tick <= 6; ++tick) {
    const CameraModel camera{131.25, 131.25, 79.5, 59.5, 160, 120};
    DepthImage depth(160, 120, static_cast<uint16_t>(6000 + 200 * tick));
    owners.push_back({0, tick});
    ASSERT_TRUE(map.fuse(camera, ColourImage(160, 120, Rgb{90, 120, 200}), depth,
                         Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * tick, Eigen::Vector3d::UnitY())),
                              Eigen::Vector3d(0.3 * tick, 0, 0)),
                         tick - 1, {SeenBy::kActive, 0, tick, 200}));
  }
  const auto before = map.download();
  ASSERT_TRUE(before && before->size() > 5000);
  auto graph = sampleGraph(*before, owners, 200, 1024, NodeOrder::kTime);
  std::vector<DeformationConstraint> constraints;
  for (size_t i = 0; i < before->size(); i += 50) {
    const TimedPoint point{(*before)[i].surfel.position.cast<double>(), owners[(*before)[i].surfel.owner]};
    constraints.push_back({point, point, true});
  }
  ASSERT_TRUE(solveDeformation(graph, constraints, {}).solved);
  ASSERT_TRUE(deformMap(map, owners, graph, 7));
  const auto after = map.download();
  ASSERT_TRUE(after);
  ASSERT_EQ(after->size(), before->size());
  for (size_t i = 0; i < after->size(); ++i) {
    ASSERT_EQ((*after)[i].surfel.position, (*before)[i].surfel.position) << i;
    ASSERT_EQ((*after)[i].surfel.normal, (*before)[i].surfel.normal) << i;
  }
}

}  // namespace
}  // namespace comap
