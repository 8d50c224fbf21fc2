#include "mapping_core/graph/graph_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "mapping_core/graph/block_cholesky.h"
#include "mapping_core/graph/edge_residual.h"

namespace comap {
namespace {

constexpr uint32_t kHeld = std::numeric_limits<uint32_t>::max();
constexpr double kLeastDiagonal = 1e-6;  // as Ceres has it: a pose that nothing holds does not move

// The edges that touch a free pose, and the normal equations of these poses.
class NormalEquations {
 public:
  NormalEquations(const GraphProblem& graph, std::span<const uint32_t> free) : graph_(graph), free_(free) {
    std::vector<uint32_t> row(graph.poses(), kHeld);
    for (uint32_t i = 0; i < free.size(); ++i) row[free[i]] = i;
    for (uint32_t i = 0; i < free.size(); ++i) {
      for (const uint32_t number : graph.edgesAt(free[i])) {
        const auto& edge = graph.edge(number);
        const uint32_t other = row[edge.from == free[i] ? edge.to : edge.from];
        if (graph.weight(number) <= 0 || other < i) continue;  // the other end brings it
        terms_.push_back({number, row[edge.from], row[edge.to], 0});
      }
    }
    for (const Term& term : terms_)
      if (term.from != kHeld && term.to != kHeld) below_.emplace_back(pairOf(term));
    std::sort(below_.begin(), below_.end());
    below_.erase(std::unique(below_.begin(), below_.end()), below_.end());
    for (Term& term : terms_)
      if (term.from != kHeld && term.to != kHeld)
        term.block =
            static_cast<uint32_t>(std::lower_bound(below_.begin(), below_.end(), pairOf(term)) - below_.begin());
    factors_.emplace(free.size(), below_);
  }

  bool empty() const { return terms_.empty(); }

  double cost() const {
    double sum = 0;
    for (const Term& term : terms_) sum += 0.5 * graph_.weight(term.edge) * graph_.chi2(term.edge);
    return sum;
  }

  /// The step by each free pose, and by how much the cost would fall if the graph were linear.
  struct Step {
    std::vector<Vector6d> by;
    double gain = 0;
  };
  std::optional<Step> step(double trust_radius) {
    build();
    for (Matrix6d& block : diagonal_) block.diagonal() += block.diagonal().cwiseMax(kLeastDiagonal) / trust_radius;
    if (!factors_->factorise(diagonal_, offdiagonal_)) return std::nullopt;
    Step step{factors_->solve(gradient_), 0};
    for (size_t i = 0; i < free_.size(); ++i) {
      step.by[i] = -step.by[i];
      step.gain -= 0.5 * gradient_[i].dot(step.by[i]);
    }
    return step;
  }

 private:
  struct Term {
    uint32_t edge, from, to;  // rows of its ends
    uint32_t block;           // of below_
  };

  static std::pair<uint32_t, uint32_t> pairOf(const Term& term) {
    return {std::max(term.from, term.to), std::min(term.from, term.to)};
  }

  void build() {
    diagonal_.assign(free_.size(), Matrix6d::Zero());
    offdiagonal_.assign(below_.size(), Matrix6d::Zero());
    gradient_.assign(free_.size(), Vector6d::Zero());
    for (const Term& term : terms_) {
      const auto& edge = graph_.edge(term.edge);
      const double weight = graph_.weight(term.edge) / graph_.scale(edge.kind);
      const EdgeResidual r = edgeResidual(graph_.pose(edge.from), graph_.pose(edge.to), edge.T_from_to);
      const Vector6d pull = weight * (edge.root * r.increment);
      const Matrix6d from = edge.root * r.d_from, to = edge.root * r.d_to;
      if (term.from != kHeld) {
        diagonal_[term.from].noalias() += weight * from.transpose() * from;
        gradient_[term.from].noalias() += from.transpose() * pull;
      }
      if (term.to != kHeld) {
        diagonal_[term.to].noalias() += weight * to.transpose() * to;
        gradient_[term.to].noalias() += to.transpose() * pull;
      }
      if (term.from == kHeld || term.to == kHeld) continue;
      if (term.from > term.to) {
        offdiagonal_[term.block].noalias() += weight * from.transpose() * to;
      } else {
        offdiagonal_[term.block].noalias() += weight * to.transpose() * from;
      }
    }
  }

  const GraphProblem& graph_;
  std::span<const uint32_t> free_;
  std::vector<Term> terms_;
  std::vector<std::pair<uint32_t, uint32_t>> below_;
  std::optional<BlockCholesky> factors_;
  std::vector<Matrix6d> diagonal_, offdiagonal_;
  std::vector<Vector6d> gradient_;
};

}  // namespace

Result<int> solveNear(GraphProblem& graph, std::span<const uint32_t> free, const GraphSolveLimits& limits) {
  NormalEquations equations(graph, free);
  if (equations.empty()) return 0;
  double cost = equations.cost();
  for (int iteration = 0; iteration < limits.max_iterations; ++iteration) {
    const auto step = equations.step(limits.trust_radius);
    const std::vector<GraphProblem::Block> before = graph.blocks();
    double next = std::numeric_limits<double>::infinity();
    if (step) {
      for (size_t i = 0; i < free.size(); ++i) graph.setPose(free[i], graph.pose(free[i]) * Pose::exp(step->by[i]));
      next = equations.cost();
    }
    const double tolerance = limits.function_tolerance * cost;
    if (!(next <= cost + tolerance)) {
      graph.setBlocks(before);
      auto damped = graph.solve(free, limits);
      return damped ? Result<int>(iteration + *damped) : damped;
    }
    const double gain = cost - next;
    cost = next;
    // What the linear graph foretold has come: there is nothing left for another step.
    if (gain <= tolerance || std::abs(gain - step->gain) <= tolerance) return iteration + 1;
  }
  return limits.max_iterations;
}

}  // namespace comap
