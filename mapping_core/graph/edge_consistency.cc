#include "mapping_core/graph/edge_consistency.h"

#include <Eigen/Cholesky>
#include <limits>
#include <queue>

namespace comap {
namespace {

std::optional<Matrix6d> covarianceOf(const GraphProblem& graph, uint32_t number) {
  const GraphProblem::BuiltEdge& edge = graph.edge(number);
  const Eigen::LDLT<Matrix6d> factors(Matrix6d(edge.root.transpose() * edge.root));
  if (factors.info() != Eigen::Success || factors.vectorD().minCoeff() <= 0) return std::nullopt;
  return Matrix6d(graph.scale(edge.kind) * factors.solve(Matrix6d::Identity()));
}

// The edges from `from` to `to`, last first; empty if there is no way.
std::vector<uint32_t> bestPath(const GraphProblem& graph, uint32_t from, uint32_t to, uint32_t without, PathOver over) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double> reached(graph.poses(), kFar);
  std::vector<uint32_t> by(graph.poses(), 0);
  reached[from] = 0;
  using Step = std::pair<double, uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
  open.emplace(0, from);
  while (!open.empty()) {
    const auto [length, pose] = open.top();
    open.pop();
    if (pose == to) break;
    if (length > reached[pose]) continue;
    for (const uint32_t i : graph.edgesAt(pose)) {
      if (i == without || graph.weight(i) < 1) continue;
      const GraphProblem::BuiltEdge& edge = graph.edge(i);
      if (over == PathOver::kOdometry && edge.kind != EdgeKind::kOdometry) continue;
      const double there = length + graph.spread(i);
      const uint32_t other = edge.from == pose ? edge.to : edge.from;
      if (there >= reached[other]) continue;
      reached[other] = there;
      by[other] = i;
      open.emplace(there, other);
    }
  }
  std::vector<uint32_t> path;
  if (reached[to] == kFar) return path;
  for (uint32_t pose = to; pose != from;) {
    const uint32_t i = by[pose];
    path.push_back(i);
    pose = graph.edge(i).from == pose ? graph.edge(i).to : graph.edge(i).from;
  }
  return path;
}

}  // namespace

std::optional<double> pathChi2(const GraphProblem& graph, uint32_t number, PathOver over) {
  const GraphProblem::BuiltEdge& edge = graph.edge(number);
  std::vector<uint32_t> path = bestPath(graph, edge.from, edge.to, number, over);
  if (path.empty()) return std::nullopt;
  auto covariance = covarianceOf(graph, number);
  if (!covariance) return std::nullopt;
  const Pose T_from_map = graph.pose(edge.from).inverse();
  for (const uint32_t i : path) {
    const auto part = covarianceOf(graph, i);
    if (!part) return std::nullopt;
    // An edge's covariance is for an increment in its own `from` frame, whichever way the path goes.
    const Matrix6d carry = (T_from_map * graph.pose(graph.edge(i).from)).adjoint();
    *covariance += carry * *part * carry.transpose();
  }
  const Vector6d increment = (T_from_map * graph.pose(edge.to) * edge.T_from_to.inverse()).log();
  return increment.dot(covariance->ldlt().solve(increment));
}

}  // namespace comap
