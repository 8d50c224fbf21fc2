#include "mapping_core/graph/graph_clusters.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mapping_core/graph/edge_residual.h"
#include "mapping_core/graph/graph_newton.h"

namespace comap {
namespace {

// S with S^T S = information, for a matrix that may be singular.
Matrix6d rootOf(const Matrix6d& information) {
  const Eigen::LDLT<Matrix6d> factors(information);
  const Matrix6d permutation = factors.transpositionsP() * Matrix6d::Identity();
  const Vector6d d = factors.vectorD().cwiseMax(0.0).cwiseSqrt();
  return d.asDiagonal() * Matrix6d(factors.matrixU()) * permutation;
}

// The same edge between the frames of the bodies its ends ride on.
GraphProblem::BuiltEdge carried(const GraphProblem::BuiltEdge& edge, double weight, const Pose& T_body_from,
                                const Pose& T_body_to) {
  GraphProblem::BuiltEdge result = edge;
  result.T_from_to = T_body_from * edge.T_from_to * T_body_to.inverse();
  result.root = std::sqrt(weight) * edge.root * T_body_from.inverse().adjoint();
  return result;
}

uint64_t keyOf(uint32_t low, uint32_t high) { return (uint64_t{low} << 32) | high; }

}  // namespace

void GraphClusters::addPose(std::optional<uint32_t> hangs_on) {
  const auto pose = static_cast<uint32_t>(cluster_.size());
  if (hangs_on && members_[cluster_[*hangs_on]].size() < kSize) {
    cluster_.push_back(cluster_[*hangs_on]);
  } else {
    cluster_.push_back(static_cast<uint32_t>(members_.size()));
    members_.emplace_back();
    changes_.push_back(0);
    inner_.emplace_back();
    links_at_.emplace_back();
  }
  members_[cluster_.back()].push_back(pose);
}

void GraphClusters::addEdge(uint32_t number) {
  const GraphProblem::BuiltEdge& edge = graph_.edge(number);
  const uint32_t a = cluster_[edge.from], b = cluster_[edge.to];
  if (a == b) {
    inner_[a].push_back(number);
    return;
  }
  const uint32_t low = std::min(a, b), high = std::max(a, b);
  const auto [it, fresh] = link_of_.try_emplace(keyOf(low, high), static_cast<uint32_t>(links_.size()));
  if (fresh) {
    links_.push_back({low, high, {}, false, std::nullopt});
    links_at_[low].push_back(it->second);
    links_at_[high].push_back(it->second);
  }
  links_[it->second].edges.push_back(number);
  links_[it->second].gathered = false;
}

void GraphClusters::touchEdge(uint32_t number) {
  const uint32_t a = cluster_[graph_.edge(number).from], b = cluster_[graph_.edge(number).to];
  if (a != b) links_[link_of_.at(keyOf(std::min(a, b), std::max(a, b)))].gathered = false;
}

void GraphClusters::touchCluster(uint32_t cluster) {
  ++changes_[cluster];
  for (const uint32_t link : links_at_[cluster]) links_[link].gathered = false;
}

void GraphClusters::touchAll() {
  for (Link& link : links_) link.gathered = false;
}

// The sum of the edges' quadratic forms about where the bodies stand, as one edge.
void GraphClusters::gather(Link& link) const {
  const Pose T_map_low = bodyFrame(link.low), T_map_high = bodyFrame(link.high);
  const Pose T_low_map = T_map_low.inverse(), T_high_map = T_map_high.inverse();
  const Pose T_low_high = T_low_map * T_map_high;
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (const uint32_t number : link.edges) {
    const GraphProblem::BuiltEdge& edge = graph_.edge(number);
    if (graph_.weight(number) <= 0) continue;
    const bool turned = cluster_[edge.from] == link.high;
    const Pose& T_from_map = turned ? T_high_map : T_low_map;
    const Pose& T_to_map = turned ? T_low_map : T_high_map;
    const GraphProblem::BuiltEdge moved = carried(edge, graph_.weight(number) / graph_.scale(edge.kind),
                                                  T_from_map * graph_.pose(edge.from), T_to_map * graph_.pose(edge.to));
    const Pose T_edge = turned ? T_low_high.inverse() : T_low_high;
    const Vector6d increment = (T_edge * moved.T_from_to.inverse()).log();
    Matrix6d j = moved.root * inverseLeftJacobian(increment);  // by a left increment of T_low_high
    if (turned) j = -j * T_edge.adjoint();
    information += j.transpose() * j;
    gradient += j.transpose() * (moved.root * increment);
  }
  link.gathered = true;
  link.edge.reset();
  if (information.isZero(0)) return;
  const Matrix6d regular = information + 1e-9 * information.trace() * Matrix6d::Identity();
  GraphProblem::BuiltEdge edge;
  edge.T_from_to = Pose::exp(-regular.ldlt().solve(gradient)) * T_low_high;
  edge.root = rootOf(information);
  link.edge = edge;
}

Result<int> GraphClusters::solve(const std::vector<uint8_t>& active, uint32_t anchor, const GraphSolveLimits& limits) {
  GraphProblem mixed;
  std::vector<uint32_t> free, body(size()), node(graph_.poses());
  std::vector<Pose> T_body_pose(graph_.poses());
  for (uint32_t c = 0; c < size(); ++c) {
    if (!active[c]) {
      const Pose T_map_body = bodyFrame(c), T_body_map = T_map_body.inverse();
      body[c] = mixed.addPose(T_map_body);
      if (cluster_[anchor] != c) free.push_back(body[c]);
      for (const uint32_t pose : members_[c]) {
        node[pose] = body[c];
        T_body_pose[pose] = T_body_map * graph_.pose(pose);
      }
      continue;
    }
    for (const uint32_t pose : members_[c]) {
      node[pose] = mixed.addPose(graph_.pose(pose));
      if (pose != anchor) free.push_back(node[pose]);
    }
  }
  const auto addEdge = [&](uint32_t number) {
    if (graph_.weight(number) <= 0) return;
    const GraphProblem::BuiltEdge& edge = graph_.edge(number);
    GraphProblem::BuiltEdge moved =
        carried(edge, graph_.weight(number) / graph_.scale(edge.kind), T_body_pose[edge.from], T_body_pose[edge.to]);
    moved.from = node[edge.from];
    moved.to = node[edge.to];
    mixed.addEdge(moved);
  };
  for (uint32_t c = 0; c < size(); ++c)
    if (active[c])
      for (const uint32_t number : inner_[c]) addEdge(number);
  for (Link& link : links_) {
    if (active[link.low] || active[link.high]) {
      for (const uint32_t number : link.edges) addEdge(number);
      continue;
    }
    if (!link.gathered) gather(link);
    if (!link.edge) continue;
    link.edge->from = body[link.low];
    link.edge->to = body[link.high];
    mixed.addEdge(*link.edge);
  }
  auto iterations = solveNear(mixed, free, limits);
  if (!iterations) return iterations;
  for (uint32_t c = 0; c < size(); ++c) {
    for (const uint32_t pose : members_[c]) graph_.setPose(pose, mixed.pose(node[pose]) * T_body_pose[pose]);
    if (active[c]) touchCluster(c);
  }
  return iterations;
}

}  // namespace comap
