#include "mapping_core/graph/settled_graph.h"

#include <gtest/gtest.h>

#include "tests/scenes/building_graph.h"

namespace comap {
namespace {

// A building in which every fifth closure is false, solved as a whole but for its last keyframe.
class SettledGraph : public testing::Test {
 protected:
  void SetUp() override {
    BuildingOptions options;
    options.keyframes = 150;
    options.false_share = 0.2;
    building_ = makeBuildingGraph(options);
    anchor_ = building_.keyframes.front().id;
    std::map<KeyframeId, Pose> initial;
    for (size_t i = 0; i + 1 < building_.keyframes.size(); ++i) {
      const auto& keyframe = building_.keyframes[i];
      initial[keyframe.id] = keyframe.T_map_cam;
      edges_.insert(edges_.end(), keyframe.edges.begin(), keyframe.edges.end());
    }
    auto solution = optimiseGraph(initial, edges_, anchor_);
    ASSERT_TRUE(solution) << solution.error().text;
    T_map_cam_ = std::move(solution->T_map_cam);
    weight_ = std::move(solution->edge_weight);
  }
  static double worstMotion(const std::map<KeyframeId, Pose>& from, const GraphSolver& to) {
    double worst = 0;
    for (const auto& [id, T] : from) worst = std::max(worst, (T.translation() - to.pose(id).translation()).norm());
    return worst;
  }

  BuildingGraph building_;
  KeyframeId anchor_;
  std::vector<Edge> edges_;
  std::map<KeyframeId, Pose> T_map_cam_;
  std::vector<double> weight_;
};

TEST_F(SettledGraph, takesPosesAndRejectionsAsTheyAre) {
  auto graph = settledGraph(T_map_cam_, edges_, anchor_, {});
  ASSERT_TRUE(graph) << graph.error().text;
  EXPECT_EQ((*graph)->keyframes(), T_map_cam_.size());
  size_t rejected = 0;
  for (size_t i = 0; i < edges_.size(); ++i) {
    EXPECT_EQ((*graph)->uses(keyOf(edges_[i])), weight_[i] > 0);
    rejected += weight_[i] == 0;
  }
  EXPECT_GT(rejected, 0u);
  const auto update = (*graph)->solve();
  ASSERT_TRUE(update);
  EXPECT_EQ(update->iterations, 0) << "there is nothing new";
  EXPECT_EQ(worstMotion(T_map_cam_, **graph), 0);
}

TEST_F(SettledGraph, goesOnAsTheGraphThatGrew) {
  auto graph = settledGraph(T_map_cam_, edges_, anchor_, {});
  ASSERT_TRUE(graph);
  const auto& last = building_.keyframes.back();
  const Edge& odometry = last.edges.front();
  ASSERT_TRUE((*graph)->addKeyframe(last.id, T_map_cam_.at(odometry.from) * odometry.T_from_to, odometry.from));
  for (const Edge& edge : last.edges) ASSERT_TRUE((*graph)->addEdge(edge));
  ASSERT_TRUE((*graph)->solve());

  std::vector<Edge> all = edges_;
  all.insert(all.end(), last.edges.begin(), last.edges.end());
  std::map<KeyframeId, Pose> initial = T_map_cam_;
  initial[last.id] = (*graph)->pose(last.id);
  const auto whole = optimiseGraph(initial, all, anchor_);
  ASSERT_TRUE(whole);
  EXPECT_LT(worstMotion(whole->T_map_cam, **graph), 0.001);
}

TEST_F(SettledGraph, edgesToOtherMapsAreLeftOutAndAMissingAnchorIsRefused) {
  std::vector<Edge> edges = edges_;
  edges.push_back(edges_.back());
  edges.back().to = {"elsewhere", 1, 0};
  auto graph = settledGraph(T_map_cam_, edges, anchor_, {});
  ASSERT_TRUE(graph);
  EXPECT_EQ((*graph)->edges(), edges_.size());
  const auto refused = settledGraph(T_map_cam_, edges_, {"elsewhere", 1, 0}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace comap
