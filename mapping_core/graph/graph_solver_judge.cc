// Which edges take part.
#include <algorithm>
#include <cmath>

#include "mapping_core/graph/edge_consistency.h"
#include "mapping_core/graph/graph_solver.h"
#include "mapping_core/graph/loop_weights.h"

namespace comap {
namespace {

// A path's covariance is a linear guess and scales are estimates: only what is far beyond the gate is refuted unheard.
constexpr double kRefuted = 4;
constexpr double kHopeless = 25;  // the same against odometry alone
constexpr int kDropRounds = 4;
constexpr double kDecided = 1e6;  // sharpness beyond which a weight is 0 or 1
constexpr size_t kGroup =
    3;  // closures that agree with each other and were rejected one by one: they are heard together
constexpr double kAgree_m = 0.3, kAgree_rad = 0.1, kSamePlace_m = 5;

}  // namespace

// New closures that the graph refutes along a path are rejected at once. Returns the others, which are on trial. The
// fresh ones do not vouch for each other: a pair of false ones may agree.
std::vector<uint32_t> GraphSolver::screen(const std::vector<uint32_t>& fresh) {
  std::vector<uint32_t> trial;
  for (const uint32_t i : fresh)
    if (gated(i)) setWeight(i, 0);
  for (const uint32_t i : fresh) {
    if (!gated(i)) continue;
    if (!fits(i)) {
      const auto chi2 = pathChi2(graph_, i);
      if (chi2 && *chi2 > kRefuted * options_.graph.gate_chi2) continue;
    }
    trial.push_back(i);
  }
  for (const uint32_t i : trial) setWeight(i, 1);
  return trial;
}

std::vector<uint32_t> GraphSolver::conflicts() const {
  std::vector<uint32_t> result;
  for (uint32_t i = 0; i < graph_.edges(); ++i)
    if (edges_moved_[i] && gated(i) && graph_.weight(i) > 0 && !fits(i)) result.push_back(i);
  return result;
}

// Either the new closures are wrong or those they contradict: whichever way leaves less to explain is taken.
Result<void> GraphSolver::judge(std::vector<uint32_t> trial, const State& before) {
  State without = before;
  for (const uint32_t i : trial) without.weights[i] = 0;
  const auto isTrial = [&](uint32_t i) { return std::find(trial.begin(), trial.end(), i) != trial.end(); };
  for (int round = 0; round < kDropRounds; ++round) {
    const std::vector<uint32_t> against = conflicts();
    if (against.empty()) return {};
    double worst = 0;
    for (const uint32_t i : against)
      if (isTrial(i)) worst = std::max(worst, graph_.chi2(i));
    if (worst == 0 || trial.size() <= 1) break;
    std::erase_if(trial, [&](uint32_t i) { return graph_.chi2(i) >= worst / 3; });
    restore(without);
    for (const uint32_t i : trial) setWeight(i, 1);
    if (auto relaxed = relax(clustersOf(trial)); !relaxed) return relaxed.error();
  }
  const std::vector<uint32_t> against = conflicts();
  if (against.empty()) return {};
  const bool only_trial = std::all_of(against.begin(), against.end(), isTrial);
  if (!only_trial) {
    if (auto dropped = dropConflicts(trial); !dropped) return dropped;
    const double cost_with = robustCost();
    const State with = state();
    const std::set<uint32_t> restless = restless_;
    restore(without);
    if (robustCost() <= cost_with) {
      restless_.clear();
      return {};
    }
    restore(with);
    restless_ = restless;
    return {};
  }
  restore(without);
  restless_.clear();
  return {};
}

// Rejects what contradicts, but none of `spared`, until nothing does.
Result<void> GraphSolver::dropConflicts(std::vector<uint32_t> spared) {
  std::sort(spared.begin(), spared.end());
  for (int round = 0; round < kDropRounds; ++round) {
    std::vector<uint32_t> against = conflicts();
    std::erase_if(against, [&](uint32_t i) { return std::binary_search(spared.begin(), spared.end(), i); });
    if (against.empty()) return {};
    for (const uint32_t i : against) setWeight(i, 0);
    if (auto relaxed = relax(clustersOf(against)); !relaxed) return relaxed.error();
  }
  return {};
}

// What was rejected and fits now that poses have moved.
Result<void> GraphSolver::readmit() {
  std::vector<uint32_t> back;
  for (const uint32_t i : rejected_)
    if (fits(i)) back.push_back(i);
  if (back.empty()) return {};
  for (const uint32_t i : back) {
    setWeight(i, 1);
    edges_moved_[i] = 1;
  }
  std::vector<uint8_t> active = clustersOf(back);
  for (const uint32_t c : restless_) active[c] = 1;
  if (auto relaxed = relax(active); !relaxed) return relaxed.error();
  return dropConflicts({});
}

// Rejected closures that say the same of the same two places as `edge`, itself among them.
std::vector<uint32_t> GraphSolver::agreeing(uint32_t edge) const {
  const GraphProblem::BuiltEdge& e = graph_.edge(edge);
  const auto correction = [&](const GraphProblem::BuiltEdge& x) {
    return graph_.pose(x.from) * x.T_from_to * graph_.pose(x.to).inverse();
  };
  const Pose T_claimed = correction(e);
  const Eigen::Vector3d from = graph_.pose(e.from).translation(), to = graph_.pose(e.to).translation();
  std::vector<uint32_t> group;
  std::set<uint32_t> ends;  // views of their own
  for (const uint32_t i : rejected_) {
    GraphProblem::BuiltEdge x = graph_.edge(i);
    const auto near = [&](uint32_t pose, const Eigen::Vector3d& place) {
      return (graph_.pose(pose).translation() - place).norm() < kSamePlace_m;
    };
    if (!near(x.from, from) || !near(x.to, to)) {
      if (!near(x.to, from) || !near(x.from, to)) continue;
      std::swap(x.from, x.to);
      x.T_from_to = x.T_from_to.inverse();
    }
    const Pose difference = T_claimed.inverse() * correction(x);
    if ((difference * to - to).norm() > kAgree_m || difference.angle() > kAgree_rad) continue;
    if (ends.contains(x.from) || ends.contains(x.to)) continue;
    ends.insert(x.from);
    ends.insert(x.to);
    group.push_back(i);
  }
  return group;
}

// One closure against the graph may be outvoted by a false one that came before; several that agree are heard together.
// In the order in which they came, as long as there is time in this call.
Result<void> GraphSolver::hearTheRejected() {
  while (!unheard_.empty() && !hasDoneEnough()) {
    const uint32_t i = unheard_.front();
    unheard_.erase(unheard_.begin());
    if (!rejected_.contains(i)) continue;
    const auto chi2 = pathChi2(graph_, i, PathOver::kOdometry);
    if (chi2 && *chi2 > kHopeless * options_.graph.gate_chi2) continue;
    const std::vector<uint32_t> group = agreeing(i);
    if (group.size() < kGroup) continue;
    const State before = state();
    const std::set<uint32_t> restless = restless_;
    const double cost_before = robustCost();
    for (const uint32_t k : group) {
      setWeight(k, 1);
      edges_moved_[k] = 1;
    }
    if (auto relaxed = relax(clustersOf(group)); !relaxed) return relaxed.error();
    if (auto dropped = dropConflicts(group); !dropped) return dropped;
    if (auto dropped = dropConflicts({}); !dropped) return dropped;
    if (robustCost() < cost_before) continue;
    restore(before);
    restless_ = restless;
  }
  return {};
}

// Edges near the gate are weighed softly at first, so that deciding one does not decide the others.
Result<void> GraphSolver::sharpenAll() {
  const double gate = options_.graph.gate_chi2;
  for (const double mu : {1.0, 2.0, 4.0, 2 * kDecided, 2 * kDecided, 2 * kDecided}) {
    bool changed = false;
    for (uint32_t i = 0; i < graph_.edges(); ++i) {
      if (removed_[i] || !gated(i)) continue;
      const double chi2 = graph_.chi2(i);
      const double weight = mu > kDecided ? (chi2 <= gate ? 1.0 : 0.0) : loopWeight(chi2, gate, mu);
      if (weight == graph_.weight(i)) continue;
      setWeight(i, weight);
      poses_moved_[graph_.edge(i).from] = poses_moved_[graph_.edge(i).to] = 1;
      changed = true;
    }
    if (!changed) {
      if (mu > kDecided) break;
      continue;
    }
    if (auto relaxed = relaxAll(); !relaxed) return relaxed.error();
  }
  return {};
}

}  // namespace comap
