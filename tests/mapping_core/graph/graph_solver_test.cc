#include "mapping_core/graph/graph_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/scenes/building_graph.h"

namespace comap {
namespace {

KeyframeId idOf(uint32_t sequence, const std::string& robot = "alpha") { return {robot, 7, sequence}; }

Matrix6d informationOf(double metres, double radians) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return Matrix6d(sigma.cwiseAbs2().cwiseInverse().asDiagonal());
}

// A keyframe comes as it does in the core: where its predecessor now stands, times its odometry.
void add(const BuildingGraph::Keyframe& keyframe, GraphSolver& solver) {
  const bool first = keyframe.id.sequence == 0;
  const Pose T = first ? keyframe.T_map_cam : solver.pose(keyframe.edges[0].from) * keyframe.edges[0].T_from_to;
  ASSERT_TRUE(solver.addKeyframe(keyframe.id, T, first ? std::nullopt : std::optional(keyframe.edges[0].from)));
  for (const Edge& edge : keyframe.edges) ASSERT_TRUE(solver.addEdge(edge));
}

void grow(const BuildingGraph& building, GraphSolver& solver) {
  for (const auto& keyframe : building.keyframes) {
    ASSERT_NO_FATAL_FAILURE(add(keyframe, solver));
    const auto update = solver.solve();
    ASSERT_TRUE(update) << update.error().text;
  }
}

double rmse(const BuildingGraph& building, const GraphSolver& solver) {
  double sum = 0;
  for (const auto& keyframe : building.keyframes)
    sum += (solver.pose(keyframe.id).translation() - keyframe.T_map_cam.translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(building.keyframes.size()));
}

struct Distance {
  double worst_m = 0, worst_rad = 0;
  double cost = 0;  // by which the optimum is lower
};

// To the optimum over the same edges, solved as a whole.
Distance distanceToOptimum(const std::vector<Edge>& edges, const std::vector<KeyframeId>& ids,
                           const GraphSolver& solver) {
  std::map<KeyframeId, Pose> poses;
  for (const KeyframeId& id : ids) poses[id] = solver.pose(id);
  std::vector<Edge> used;
  for (const Edge& edge : edges)
    if (solver.uses(keyOf(edge))) used.push_back(edge);
  GraphOptions options;
  options.reject_loops = false;
  const auto batch = optimiseGraph(poses, used, ids.front(), options);
  EXPECT_TRUE(batch);
  Distance distance;
  distance.cost = batch->initial_cost - batch->final_cost;
  for (const auto& [id, T] : batch->T_map_cam) {
    const Pose difference = T.inverse() * poses.at(id);
    distance.worst_m = std::max(distance.worst_m, difference.translation().norm());
    distance.worst_rad = std::max(distance.worst_rad, difference.angle());
  }
  return distance;
}

Distance distanceToOptimum(const BuildingGraph& building, const GraphSolver& solver) {
  std::vector<Edge> edges;
  std::vector<KeyframeId> ids;
  for (const auto& keyframe : building.keyframes) {
    ids.push_back(keyframe.id);
    edges.insert(edges.end(), keyframe.edges.begin(), keyframe.edges.end());
  }
  return distanceToOptimum(edges, ids, solver);
}

BuildingGraph withoutFalse(BuildingGraph building) {
  for (auto& keyframe : building.keyframes) {
    std::vector<Edge> edges;
    for (size_t i = 0; i < keyframe.edges.size(); ++i)
      if (!keyframe.edge_false[i]) edges.push_back(keyframe.edges[i]);
    keyframe.edges = edges;
  }
  return building;
}

TEST(GraphSolver, grownEdgeByEdgeItStandsWhereTheWholeSolutionIs) {
  BuildingOptions options;
  options.keyframes = 400;
  const BuildingGraph building = makeBuildingGraph(options);
  GraphSolver solver;
  ASSERT_NO_FATAL_FAILURE(grow(building, solver));
  const Distance distance = distanceToOptimum(building, solver);
  EXPECT_LT(distance.cost, 0.2) << "far less than the one by which poses are known";
  EXPECT_LT(distance.worst_m, 0.0015);
  EXPECT_LT(distance.worst_rad, 0.0005);
  EXPECT_GT(rmse(building, solver), 10 * 0.0005) << "the tolerance is no small part of the error: no test";
}

TEST(GraphSolver, randomFalseClosuresAreRejectedAndDoNoHarm) {
  for (const bool pairs : {false, true}) {
    BuildingOptions options;
    options.keyframes = 400;
    options.false_share = 0.2;
    options.false_in_pairs = pairs;
    options.seed = 3;
    const BuildingGraph building = makeBuildingGraph(options);
    GraphSolver solver, clean;
    ASSERT_NO_FATAL_FAILURE(grow(building, solver));
    ASSERT_NO_FATAL_FAILURE(grow(withoutFalse(building), clean));
    size_t all_false = 0, lost = 0, all_true = 0;
    for (const auto& keyframe : building.keyframes)
      for (size_t i = 0; i < keyframe.edges.size(); ++i) {
        const bool used = solver.uses(keyOf(keyframe.edges[i]));
        if (keyframe.edge_false[i]) {
          EXPECT_FALSE(used) << toString(keyframe.id);
          ++all_false;
        } else if (keyframe.edges[i].kind != EdgeKind::kOdometry) {
          lost += !used;
          ++all_true;
        }
      }
    EXPECT_GT(all_false, 30u);
    EXPECT_LE(static_cast<double>(lost), 0.02 * static_cast<double>(all_true)) << "beyond the 1 % tail of the gate";
    EXPECT_NEAR(rmse(building, solver), rmse(building, clean), 0.1 * rmse(building, clean)) << "pairs " << pairs;
  }
}

// A ring walked once with odometry that drifts, and one closure.
struct Ring {
  std::vector<KeyframeId> ids;
  std::vector<Pose> truth;
  std::vector<Edge> edges;
};

Ring ringOf(uint32_t keyframes, GraphSolver& solver) {
  Ring ring;
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const double radius = keyframes * 0.25 / (2 * std::numbers::pi);
  for (uint32_t i = 0; i < keyframes; ++i) {
    const double angle = 2 * std::numbers::pi * i / keyframes;
    ring.ids.push_back(idOf(i));
    ring.truth.push_back(Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                              {radius * std::cos(angle), radius * std::sin(angle), 0}));
    if (i == 0) {
      EXPECT_TRUE(solver.addKeyframe(ring.ids[0], ring.truth[0]));
      continue;
    }
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi(k) = normal(engine) * (k < 3 ? 0.003 : 0.001);
    const Pose Z = Pose::exp(xi) * ring.truth[i - 1].inverse() * ring.truth[i];
    ring.edges.push_back({ring.ids[i - 1], ring.ids[i], EdgeKind::kOdometry, Z, informationOf(0.003, 0.001)});
    EXPECT_TRUE(solver.addKeyframe(ring.ids[i], solver.pose(ring.ids[i - 1]) * Z, ring.ids[i - 1]));
    EXPECT_TRUE(solver.addEdge(ring.edges.back()));
  }
  return ring;
}

Edge closureOf(const Ring& ring, uint32_t from, uint32_t to) {
  return {ring.ids[from], ring.ids[to], EdgeKind::kLoop, ring.truth[from].inverse() * ring.truth[to],
          informationOf(0.005, 0.002)};
}

GraphUpdate settle(GraphSolver& solver) {
  for (int i = 0; i < 20; ++i) {
    auto update = solver.solve();
    EXPECT_TRUE(update);
    if (!update || update->settled) return update ? *update : GraphUpdate{};
  }
  ADD_FAILURE() << "not settled";
  return {};
}

TEST(GraphSolver, aLoopThatBendsEverythingIsRight) {
  GraphSolver solver;
  Ring ring = ringOf(2000, solver);
  ASSERT_TRUE(solver.solve());
  const double gap = (solver.pose(ring.ids.back()).translation() - ring.truth.back().translation()).norm();
  ASSERT_GT(gap, 0.3);
  ring.edges.push_back(closureOf(ring, 2, 1998));
  ASSERT_TRUE(solver.addEdge(ring.edges.back()));
  settle(solver);
  EXPECT_TRUE(solver.uses(keyOf(ring.edges.back())));
  EXPECT_LT((solver.pose(ring.ids.back()).translation() - ring.truth.back().translation()).norm(), gap / 5);
  const Distance distance = distanceToOptimum(ring.edges, ring.ids, solver);
  EXPECT_LT(distance.cost, 0.05) << "far less than the one by which poses are known";
  EXPECT_LT(distance.worst_m, 0.03 * gap) << "of a correction of " << gap << " m";
}

TEST(GraphSolver, aFalseClosureThatCameFirstIsOutvoted) {
  GraphSolver solver;
  const Ring ring = ringOf(400, solver);
  Edge wrong = closureOf(ring, 50, 380);
  // As far off as drift may well be: alone, nothing speaks against it.
  wrong.T_from_to = Pose(Eigen::Quaterniond::Identity(), {0.3, 0.2, 0.1}) * wrong.T_from_to;
  ASSERT_TRUE(solver.addEdge(wrong));
  settle(solver);
  ASSERT_TRUE(solver.uses(keyOf(wrong))) << "nothing to undo: no test";
  for (const uint32_t i : {44u, 46u, 52u, 54u, 56u}) {
    ASSERT_TRUE(solver.addEdge(closureOf(ring, i, i + 330)));
    settle(solver);
  }
  EXPECT_FALSE(solver.uses(keyOf(wrong)));
  for (const uint32_t i : {44u, 46u, 52u, 54u, 56u}) EXPECT_TRUE(solver.uses(keyOf(closureOf(ring, i, i + 330)))) << i;
}

TEST(GraphSolver, aRemovedEdgeLeavesNoTrace) {
  GraphSolver with, without;
  const Ring ring = ringOf(200, with);
  ringOf(200, without);
  const Edge kept = closureOf(ring, 0, 199), removed = closureOf(ring, 10, 100);
  for (GraphSolver* solver : {&with, &without}) {
    ASSERT_TRUE(solver->addEdge(kept));
    settle(*solver);
  }
  ASSERT_TRUE(with.addEdge(removed));
  settle(with);
  const double moved = (with.pose(idOf(100)).translation() - without.pose(idOf(100)).translation()).norm();
  ASSERT_GT(moved, 0.02);
  EXPECT_TRUE(with.removeEdge(keyOf(removed)));
  EXPECT_FALSE(with.removeEdge(keyOf(removed)));
  settle(with);
  for (const KeyframeId& id : ring.ids)
    EXPECT_LT((with.pose(id).translation() - without.pose(id).translation()).norm(), 0.005) << toString(id);
}

TEST(GraphSolver, scalesFindHowWrongCovariancesAre) {
  BuildingOptions options;
  options.keyframes = 500;
  options.sigma_odometry_m = 0.006;
  options.sigma_odometry_rad = 0.002;
  options.sigma_closure_m = 0.01;
  options.sigma_closure_rad = 0.004;
  BuildingGraph building = makeBuildingGraph(options);
  GraphSolverOptions plain;
  plain.graph.sigma_floor_m = plain.graph.sigma_floor_rad = 0;
  GraphSolver solver(plain);
  for (auto& keyframe : building.keyframes) {
    // Odometry says it is four times as well known (in variance) as it is; the rest says the truth.
    for (Edge& edge : keyframe.edges)
      if (edge.kind == EdgeKind::kOdometry) edge.information *= 4;
    ASSERT_NO_FATAL_FAILURE(add(keyframe, solver));
  }
  const auto update = solver.solveFully();
  ASSERT_TRUE(update) << update.error().text;
  EXPECT_NEAR(update->scale[static_cast<size_t>(EdgeKind::kOdometry)], 4, 1.2);
  EXPECT_NEAR(update->scale[static_cast<size_t>(EdgeKind::kCovisibility)], 1, 0.3);
  EXPECT_NEAR(update->scale[static_cast<size_t>(EdgeKind::kLoop)], 1, 0.3);
  EXPECT_NEAR(*solver.chi2PerFreedom(EdgeKind::kOdometry), 1, 0.15);
}

TEST(GraphSolver, sameCallsSameBits) {
  BuildingOptions options;
  options.keyframes = 150;
  options.false_share = 0.2;
  const BuildingGraph building = makeBuildingGraph(options);
  GraphSolver first, second;
  ASSERT_NO_FATAL_FAILURE(grow(building, first));
  ASSERT_NO_FATAL_FAILURE(grow(building, second));
  for (const auto& keyframe : building.keyframes) {
    EXPECT_EQ(first.pose(keyframe.id).translation(), second.pose(keyframe.id).translation());
    EXPECT_EQ(first.pose(keyframe.id).rotation().coeffs(), second.pose(keyframe.id).rotation().coeffs());
  }
}

TEST(GraphSolver, badInputIsRefusedByName) {
  GraphSolver solver;
  ASSERT_TRUE(solver.addKeyframe(idOf(0), Pose()));
  ASSERT_TRUE(solver.addKeyframe(idOf(1), Pose()));
  const auto says = [](const Result<void>& result, const std::string& word) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kBadData);
    EXPECT_NE(result.error().text.find(word), std::string::npos) << result.error().text;
  };
  const double infinite = std::numeric_limits<double>::infinity();
  says(solver.addKeyframe(idOf(1), Pose()), "alpha/7/1 is in the graph already");
  says(solver.addKeyframe(idOf(2), Pose(Eigen::Quaterniond::Identity(), {infinite, 0, 0})), "not finite");
  says(solver.addEdge({idOf(0), idOf(9), EdgeKind::kLoop, {}, Matrix6d::Identity()}), "alpha/7/9 is not in the graph");
  says(solver.addEdge({idOf(0), idOf(0), EdgeKind::kLoop, {}, Matrix6d::Identity()}), "one keyframe");
  says(solver.addEdge({idOf(0), idOf(1), EdgeKind::kLoop, {}, -Matrix6d::Identity()}), "positive semidefinite");
  EXPECT_EQ(solver.edges(), 0u);
  EXPECT_EQ(solver.revision(), 2u);
}

}  // namespace
}  // namespace comap
