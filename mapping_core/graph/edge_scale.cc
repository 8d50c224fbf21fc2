#include "mapping_core/graph/edge_scale.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

constexpr double kMedianOfSix = 5.348;  // of chi2 with six degrees of freedom
constexpr double kMostLeverage = 0.8;   // an edge that the others hardly check says nothing about its own error
constexpr size_t kEnough = 30;
constexpr double kLever_m = 1;  // metres and radians weigh alike at this distance
constexpr double kLeastScale = 0.25, kMostScale = 100;

double stiffness(const GraphProblem& graph, uint32_t number) {
  const GraphProblem::BuiltEdge& edge = graph.edge(number);
  const double information =
      edge.root.leftCols<3>().squaredNorm() + edge.root.rightCols<3>().squaredNorm() / (kLever_m * kLever_m);
  return graph.weight(number) * information / graph.scale(edge.kind);
}

}  // namespace

std::optional<double> chi2PerFreedom(const GraphProblem& graph, EdgeKind kind) {
  std::vector<double> at_pose(graph.poses(), 0);
  for (uint32_t i = 0; i < graph.edges(); ++i) {
    if (graph.weight(i) <= 0) continue;
    at_pose[graph.edge(i).from] += stiffness(graph, i);
    at_pose[graph.edge(i).to] += stiffness(graph, i);
  }
  std::vector<double> ratios;
  for (uint32_t i = 0; i < graph.edges(); ++i) {
    const GraphProblem::BuiltEdge& edge = graph.edge(i);
    if (edge.kind != kind || graph.weight(i) < 1) continue;
    // The share of an edge's own error that the poses follow: its conductance times the resistance between its ends,
    // that of each end taken alone. The shares sum to the number of poses, as they must.
    const double own = stiffness(graph, i);
    const double leverage = own / at_pose[edge.from] + own / at_pose[edge.to];
    if (leverage < kMostLeverage) ratios.push_back(graph.chi2(i) / (1 - leverage));
  }
  if (ratios.size() < kEnough) return std::nullopt;
  const auto middle = ratios.begin() + static_cast<long>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle / kMedianOfSix;
}

bool estimateScales(GraphProblem& graph) {
  bool changed = false;
  std::array<double, kEdgeKinds> scales;
  for (size_t k = 0; k < kEdgeKinds; ++k) {
    const auto kind = static_cast<EdgeKind>(k);
    scales[k] = std::clamp(graph.scale(kind) * chi2PerFreedom(graph, kind).value_or(1), kLeastScale, kMostScale);
    changed = changed || std::abs(std::log(scales[k] / graph.scale(kind))) > 0.1;
  }
  for (size_t k = 0; k < kEdgeKinds; ++k) graph.setScale(static_cast<EdgeKind>(k), scales[k]);
  return changed;
}

}  // namespace comap
