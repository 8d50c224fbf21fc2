#include "mapping_core/graph/graph_solver.h"

#include <algorithm>

#include "mapping_core/graph/edge_information.h"
#include "mapping_core/graph/edge_scale.h"

namespace comap {
namespace {

bool any(const std::vector<uint8_t>& flags) {
  return std::any_of(flags.begin(), flags.end(), [](uint8_t flag) { return flag != 0; });
}

}  // namespace

EdgeKey keyOf(const Edge& edge) { return {edge.kind, edge.from, edge.to}; }

GraphSolver::GraphSolver(const GraphSolverOptions& options) : options_(options), clusters_(graph_) {}

Result<void> GraphSolver::addKeyframe(const KeyframeId& id, const Pose& T_map_cam,
                                      const std::optional<KeyframeId>& hangs_on) {
  if (number_of_.contains(id))
    return Error{ErrorCode::kBadData, "keyframe " + toString(id) + " is in the graph already"};
  if (!T_map_cam.isFinite()) return Error{ErrorCode::kBadData, "initial pose of " + toString(id) + " is not finite"};
  const auto before = hangs_on ? number_of_.find(*hangs_on) : number_of_.end();
  number_of_[id] = graph_.addPose(T_map_cam);
  ids_.push_back(id);
  clusters_.addPose(before == number_of_.end() ? std::nullopt : std::optional<uint32_t>(before->second));
  poses_moved_.push_back(0);
  ++revision_;
  return {};
}

Result<void> GraphSolver::addEdge(const Edge& edge) {
  const std::string name = "edge from " + toString(edge.from) + " to " + toString(edge.to);
  const auto from = number_of_.find(edge.from), to = number_of_.find(edge.to);
  if (from == number_of_.end() || to == number_of_.end()) {
    return Error{ErrorCode::kBadData,
                 name + ": " + toString(from == number_of_.end() ? edge.from : edge.to) + " is not in the graph"};
  }
  if (from == to) return Error{ErrorCode::kBadData, name + ": both ends are one keyframe"};
  if (!edge.T_from_to.isFinite()) return Error{ErrorCode::kBadData, name + ": its pose is not finite"};
  const auto root = squareRootInformation(edge, options_.graph);
  if (!root) return Error{root.error().code, name + ": " + root.error().text};
  const EdgeKey key = keyOf(edge);
  ++revision_;
  if (const auto known = edge_of_.find(key); known != edge_of_.end()) {
    graph_.replaceEdge(known->second, edge.T_from_to, *root);
    rejected_.erase(known->second);
    setWeight(known->second, 1);
    fresh_.push_back(known->second);
    return {};
  }
  const uint32_t number = graph_.addEdge({from->second, to->second, edge.kind, edge.T_from_to, *root});
  clusters_.addEdge(number);
  edge_of_[key] = number;
  keys_.push_back(key);
  removed_.push_back(0);
  edges_moved_.push_back(0);
  fresh_.push_back(number);
  return {};
}

Result<void> GraphSolver::addSettled(const Edge& edge) {
  if (auto added = addEdge(edge); !added) return added;
  const uint32_t number = edge_of_.at(keyOf(edge));
  fresh_.pop_back();
  if (gated(number) && !fits(number)) setWeight(number, 0);
  return {};
}

bool GraphSolver::removeEdge(const EdgeKey& key) {
  const auto known = edge_of_.find(key);
  if (known == edge_of_.end()) return false;
  const uint32_t number = known->second;
  if (graph_.weight(number) > 0) {
    restless_.insert(clusters_.of(graph_.edge(number).from));
    restless_.insert(clusters_.of(graph_.edge(number).to));
  }
  setWeight(number, 0);
  removed_[number] = 1;
  rejected_.erase(number);
  edge_of_.erase(known);
  ++revision_;
  return true;
}

Pose GraphSolver::pose(const KeyframeId& id) const { return graph_.pose(number_of_.at(id)); }

bool GraphSolver::uses(const EdgeKey& key) const {
  const auto known = edge_of_.find(key);
  return known != edge_of_.end() && graph_.weight(known->second) > 0;
}

double GraphSolver::robustCost() const {
  double sum = 0;
  for (uint32_t i = 0; i < graph_.edges(); ++i) {
    if (removed_[i]) continue;
    sum += graph_.weight(i) > 0 ? graph_.chi2(i) : options_.graph.gate_chi2;
  }
  return sum;
}

void GraphSolver::restore(const State& state) {
  graph_.setBlocks(state.blocks);
  for (uint32_t i = 0; i < graph_.edges(); ++i)
    if (graph_.weight(i) != state.weights[i]) setWeight(i, state.weights[i]);
  for (uint32_t c = 0; c < clusters_.size(); ++c)
    if (clusters_.changes()[c] != state.changes[c]) clusters_.touchCluster(c);
}

void GraphSolver::setWeight(uint32_t edge, double weight) {
  graph_.setWeight(edge, weight);
  clusters_.touchEdge(edge);
  if (weight > 0) {
    rejected_.erase(edge);
  } else if (!removed_[edge]) {
    rejected_.insert(edge);
  }
}

std::vector<uint8_t> GraphSolver::clustersOf(std::span<const uint32_t> edges) const {
  std::vector<uint8_t> flags(clusters_.size(), 0);
  for (const uint32_t i : edges) {
    flags[clusters_.of(graph_.edge(i).from)] = 1;
    flags[clusters_.of(graph_.edge(i).to)] = 1;
  }
  return flags;
}

Result<GraphUpdate> GraphSolver::solve() {
  rounds_ = iterations_ = 0;
  std::fill(edges_moved_.begin(), edges_moved_.end(), 0);
  const std::vector<double> weights_before = graph_.weights();
  std::vector<uint32_t> fresh;
  for (const uint32_t i : fresh_)
    if (!removed_[i]) fresh.push_back(i);
  fresh_.clear();
  const std::vector<uint32_t> trial = screen(fresh);
  const State before = state();  // what was refuted is out of it

  std::vector<uint32_t> pulling;
  for (const uint32_t i : fresh)
    if (graph_.weight(i) > 0 && graph_.chi2(i) > 1e-6) pulling.push_back(i);
  for (const uint32_t i : pulling) edges_moved_[i] = 1;
  std::vector<uint8_t> active = clustersOf(pulling);
  for (const uint32_t cluster : restless_) active[cluster] = 1;
  if (any(active) || readmission_due_) {
    const auto steps = [&]() -> Result<void> {
      if (auto relaxed = relax(active); !relaxed) return relaxed.error();
      if (auto judged = judge(trial, before); !judged) return judged;
      readmission_due_ = hasDoneEnough() && !readmission_due_;  // put off once, not for ever
      return readmission_due_ ? Result<void>() : readmit();
    };
    if (auto done = steps(); !done) {
      restore(before);
      return done.error();
    }
  }
  for (const uint32_t i : fresh)
    if (graph_.weight(i) <= 0) unheard_.push_back(i);
  if (auto heard = hearTheRejected(); !heard) {
    restore(before);
    return heard.error();
  }
  return update(weights_before, restless_.empty() && unheard_.empty() && !readmission_due_);
}

Result<GraphUpdate> GraphSolver::solveFully() {
  rounds_ = iterations_ = 0;
  const std::vector<double> weights_before = graph_.weights();
  const State before = state();
  std::erase_if(fresh_, [this](uint32_t i) { return removed_[i] != 0; });
  screen(fresh_);
  fresh_.clear();
  unheard_.clear();
  readmission_due_ = false;
  const auto steps = [&]() -> Result<void> {
    if (auto relaxed = relaxAll(); !relaxed) return relaxed.error();
    if (auto sharpened = sharpenAll(); !sharpened) return sharpened;
    for (int i = 0; options_.calibrate && i < 3 && calibrate(); ++i) {
      if (auto sharpened = sharpenAll(); !sharpened) return sharpened;
    }
    return {};
  };
  if (auto done = steps(); !done) {
    restore(before);
    return done.error();
  }
  return update(weights_before, restless_.empty());
}

std::optional<double> GraphSolver::chi2PerFreedom(EdgeKind kind) const { return comap::chi2PerFreedom(graph_, kind); }

bool GraphSolver::calibrate() {
  const bool changed = estimateScales(graph_);
  if (changed) clusters_.touchAll();
  return changed;
}

GraphUpdate GraphSolver::update(const std::vector<double>& weights_before, bool settled) const {
  GraphUpdate update;
  update.revision = revision_;
  update.settled = settled;
  for (uint32_t i = 0; i < ids_.size(); ++i) update.T_map_cam.emplace(ids_[i], graph_.pose(i));
  for (uint32_t i = 0; i < graph_.edges(); ++i) {
    if (removed_[i]) continue;
    if (graph_.weight(i) > 0 && weights_before[i] <= 0) update.used.push_back(keys_[i]);
    if (graph_.weight(i) <= 0 && weights_before[i] > 0) update.rejected.push_back(keys_[i]);
  }
  for (size_t k = 0; k < kEdgeKinds; ++k) update.scale[k] = graph_.scale(static_cast<EdgeKind>(k));
  update.rounds = rounds_;
  update.iterations = iterations_;
  return update;
}

}  // namespace comap
