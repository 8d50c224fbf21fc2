#include "mapping_core/graph/graph_worker.h"

#include <gtest/gtest.h>

#include "tests/scenes/building_graph.h"

namespace comap {
namespace {

BuildingGraph smallBuilding() {
  BuildingOptions options;
  options.keyframes = 160;
  options.false_share = 0.1;
  return makeBuildingGraph(options);
}

std::vector<GraphChange> changesOf(const BuildingGraph::Keyframe& keyframe) {
  std::vector<GraphChange> changes;
  const bool first = keyframe.id.sequence == 0;
  changes.emplace_back(GraphKeyframe{keyframe.id, keyframe.T_map_odometry,
                                     first ? std::nullopt : std::optional(keyframe.edges[0].from)});
  for (const Edge& edge : keyframe.edges) changes.emplace_back(edge);
  return changes;
}

TEST(GraphWorker, endsWhereASolverInTheCallersThreadEnds) {
  const BuildingGraph building = smallBuilding();
  GraphWorker worker;
  GraphSolver solver;
  uint64_t revision = 0;
  for (const auto& keyframe : building.keyframes) {
    for (const GraphChange& change : changesOf(keyframe)) ASSERT_TRUE(apply(change, solver));
    revision = worker.post(changesOf(keyframe));
  }
  EXPECT_EQ(revision, building.keyframes.size() + building.edges);
  const auto update = worker.finish();
  ASSERT_TRUE(update);
  ASSERT_TRUE(*update) << update->error().text;
  EXPECT_EQ((*update)->revision, revision);
  EXPECT_TRUE((*update)->settled);
  EXPECT_EQ((*update)->T_map_cam.size(), building.keyframes.size());
  while (!solver.solve()->settled) continue;
  // Not to the bit: which changes the worker took together is a matter of time, and each solve ends near enough.
  for (const auto& [id, T] : (*update)->T_map_cam)
    EXPECT_LT((T.translation() - solver.pose(id).translation()).norm(), 0.01) << toString(id);
  EXPECT_FALSE(worker.take()) << "taken already";
}

TEST(GraphWorker, onlyTheLatestSolutionIsKeptAndNoRejectionIsLost) {
  const BuildingGraph building = smallBuilding();
  GraphWorker worker;
  size_t all_false = 0;
  std::set<EdgeKey> wrong;
  for (const auto& keyframe : building.keyframes) {
    worker.post(changesOf(keyframe));
    for (size_t i = 0; i < keyframe.edges.size(); ++i)
      if (keyframe.edge_false[i]) wrong.insert(keyOf(keyframe.edges[i]));
  }
  all_false = wrong.size();
  ASSERT_GT(all_false, 5u);
  const auto update = worker.finish();
  ASSERT_TRUE(update && *update);
  for (const EdgeKey& key : (*update)->rejected) wrong.erase(key);
  EXPECT_TRUE(wrong.empty()) << wrong.size() << " of " << all_false << " not told";
}

TEST(GraphWorker, anErrorIsToldOnceAndTheRestGoesOn) {
  GraphWorker worker;
  const KeyframeId a{"a", 1, 0}, b{"a", 1, 1};
  worker.post({GraphKeyframe{a, Pose(), {}}, Edge{a, b, EdgeKind::kOdometry, Pose(), Matrix6d::Identity()},
               GraphKeyframe{b, Pose(), a}, GraphRemoval{{EdgeKind::kLoop, a, b}}});
  const auto error = worker.finish();
  ASSERT_TRUE(error);
  ASSERT_FALSE(*error);
  EXPECT_NE(error->error().text.find("a/1/1 is not in the graph"), std::string::npos) << error->error().text;
  const auto update = worker.take();
  ASSERT_TRUE(update && *update);
  EXPECT_EQ((*update)->T_map_cam.size(), 2u);
  EXPECT_EQ((*update)->revision, 4u);
}

TEST(GraphWorker, endsInTheMiddleOfItsWork) {
  const BuildingGraph building = smallBuilding();
  for (int round = 0; round < 5; ++round) {
    GraphWorker worker;
    for (const auto& keyframe : building.keyframes) worker.post(changesOf(keyframe));
  }
  const GraphWorker idle;
}

}  // namespace
}  // namespace comap
