// Moving poses until none wants to move.
#include <algorithm>

#include "mapping_core/graph/graph_solver.h"

namespace comap {
namespace {

constexpr GraphSolveLimits kPerRound{10, 1e-8, 1e8};

Pose poseOf(const GraphProblem::Block& x) {
  return Pose(Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x.data())),
              Eigen::Map<const Eigen::Vector3d>(x.data() + 4));
}

bool any(const std::vector<uint8_t>& flags) {
  return std::any_of(flags.begin(), flags.end(), [](uint8_t flag) { return flag != 0; });
}

}  // namespace

Result<bool> GraphSolver::relax(std::vector<uint8_t> active) {
  return relax(std::move(active), options_.rounds, options_.free_poses);
}

Result<bool> GraphSolver::relax(std::vector<uint8_t> active, int max_rounds, size_t free_poses) {
  restless_.clear();
  for (int round = 0; round < max_rounds && any(active); ++round) {
    const std::vector<GraphProblem::Block> before = graph_.blocks();
    const auto iterations = clusters_.solve(active, 0, kPerRound);
    if (!iterations) return iterations.error();
    iterations_ += *iterations;
    ++rounds_;
    noteMotion(before, active);
    active = strained(active, free_poses);
  }
  for (uint32_t c = 0; c < clusters_.size(); ++c)
    if (active[c]) restless_.insert(c);
  return restless_.empty();
}

// Everything is looked at; ends when all is at rest, or what is left does not get less.
Result<bool> GraphSolver::relaxAll() {
  std::fill(edges_moved_.begin(), edges_moved_.end(), 1);
  const std::vector<uint8_t> none(clusters_.size(), 0);
  const auto iterations = clusters_.solve(none, 0, kPerRound);
  if (!iterations) return iterations.error();
  iterations_ += *iterations;
  const int sweeps = 10 + 10 * static_cast<int>(graph_.poses() / options_.free_poses_of_all);
  std::fill(poses_moved_.begin(), poses_moved_.end(), 1);
  return relax(strained(none, options_.free_poses_of_all), sweeps, options_.free_poses_of_all);
}

void GraphSolver::noteMotion(const std::vector<GraphProblem::Block>& before, const std::vector<uint8_t>& active) {
  std::vector<Pose> T_new_old;  // per pose: what it would do to a point of the map that rode on it
  for (uint32_t i = 0; i < before.size(); ++i) T_new_old.push_back(graph_.pose(i) * poseOf(before[i]).inverse());
  for (uint32_t i = 0; i < graph_.edges(); ++i) {
    const GraphProblem::BuiltEdge& edge = graph_.edge(i);
    const uint32_t cluster = clusters_.of(edge.from);
    if (removed_[i] || (cluster == clusters_.of(edge.to) && !active[cluster])) continue;
    const Pose apart = T_new_old[edge.from].inverse() * T_new_old[edge.to];
    const Eigen::Map<const Eigen::Vector3d> end(before[edge.to].data() + 4);
    const double moved_m = (apart * end - end).norm();
    if (moved_m < 0.25 * options_.settled_m && apart.angle() < 0.25 * options_.settled_rad) continue;
    edges_moved_[i] = 1;
    poses_moved_[edge.from] = poses_moved_[edge.to] = 1;
  }
}

// The clusters to solve next: those that strain most, and while there is room those that were active, so that the
// active part grows. Poses that did not move against a neighbour strain no more than before.
std::vector<uint8_t> GraphSolver::strained(const std::vector<uint8_t>& active, size_t free_poses) {
  std::vector<std::pair<double, uint32_t>> order;
  const std::vector<Vector6d> steps = graph_.relaxingSteps(poses_moved_);
  for (uint32_t c = 0; c < clusters_.size(); ++c) {
    double worst = 0;
    for (const uint32_t pose : clusters_.members(c)) {
      if (!poses_moved_[pose] || pose == 0) continue;
      const Vector6d& step = steps[pose];
      worst =
          std::max({worst, step.head<3>().norm() / options_.settled_m, step.tail<3>().norm() / options_.settled_rad});
    }
    if (worst > 1) {
      order.emplace_back(-worst, c);
    } else {
      for (const uint32_t pose : clusters_.members(c)) poses_moved_[pose] = 0;
    }
  }
  std::vector<uint8_t> next(clusters_.size(), 0);
  if (order.empty()) return next;
  std::sort(order.begin(), order.end());
  size_t poses = 0;
  const auto take = [&](uint32_t c) {
    if (next[c] || poses + clusters_.members(c).size() > free_poses) return;
    next[c] = 1;
    poses += clusters_.members(c).size();
  };
  for (const auto& [minus_worst, c] : order) take(c);
  for (uint32_t c = 0; c < clusters_.size(); ++c)
    if (active[c]) take(c);
  return next;
}

}  // namespace comap
