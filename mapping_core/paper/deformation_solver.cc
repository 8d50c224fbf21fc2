#include "mapping_core/paper/deformation_solver.h"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace comap {
namespace {

constexpr double kRotationWeight = 1, kRegularisationWeight = 10, kConstraintWeight = 100;
constexpr int kIterations = 3;
constexpr int kUnknowns = 12;  // a node: A by columns, then b

// Rows of a sparse least-squares problem over the nodes that are free.
class Rows {
 public:
  explicit Rows(const std::vector<int>& columns) : columns_(&columns) {}
  void begin(double residual, double weight) {
    scale_ = std::sqrt(weight);
    residuals_.push_back(scale_ * residual);
  }
  void add(uint32_t node, int unknown, double value) {
    if ((*columns_)[node] < 0) return;  // zeros count: the pattern must not change
    entries_.emplace_back(static_cast<int>(residuals_.size()) - 1, (*columns_)[node] + unknown, scale_ * value);
  }
  const std::vector<double>& residuals() const { return residuals_; }
  const std::vector<Eigen::Triplet<double>>& entries() const { return entries_; }

 private:
  const std::vector<int>* columns_;
  std::vector<double> residuals_;
  std::vector<Eigen::Triplet<double>> entries_;
  double scale_ = 1;
};

struct Felt {
  Influence source, target;
};

void addRotation(const DeformationGraph& graph, double weight, Rows& rows) {
  for (uint32_t n = 0; n < graph.nodes().size(); ++n) {
    const Eigen::Matrix3d& A = graph.nodes()[n].A;
    for (const auto& [a, b] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
      rows.begin(A.col(a).dot(A.col(b)), weight);
      for (int m = 0; m < 3; ++m) {
        rows.add(n, 3 * a + m, A(m, b));
        rows.add(n, 3 * b + m, A(m, a));
      }
    }
    for (int a = 0; a < 3; ++a) {
      rows.begin(A.col(a).squaredNorm() - 1, weight);
      for (int m = 0; m < 3; ++m) rows.add(n, 3 * a + m, 2 * A(m, a));
    }
  }
}

void addRegularisation(const DeformationGraph& graph, double weight, Rows& rows) {
  for (uint32_t j = 0; j < graph.nodes().size(); ++j) {
    const DeformationNode& from = graph.nodes()[j];
    for (const uint32_t n : graph.neighbours()[j]) {
      const DeformationNode& to = graph.nodes()[n];
      const Eigen::Vector3d edge = to.position - from.position;
      const Eigen::Vector3d r = (from.A - Eigen::Matrix3d::Identity()) * edge + from.b - to.b;
      for (int m = 0; m < 3; ++m) {
        rows.begin(r(m), weight);
        for (int c = 0; c < 3; ++c) rows.add(j, 3 * c + m, edge(c));
        rows.add(j, 9 + m, 1);
        rows.add(n, 9 + m, -1);
      }
    }
  }
}

void addMotion(const DeformationGraph& graph, const Influence& felt, const Eigen::Vector3d& x, int m, double sign,
               Rows& rows) {
  for (size_t i = 0; i < felt.count; ++i) {
    const Eigen::Vector3d arm = x - graph.nodes()[felt.nodes[i]].position;
    for (int c = 0; c < 3; ++c) rows.add(felt.nodes[i], 3 * c + m, sign * felt.weights[i] * arm(c));
    rows.add(felt.nodes[i], 9 + m, sign * felt.weights[i]);
  }
}

void addConstraints(const DeformationGraph& graph, const std::vector<DeformationConstraint>& constraints,
                    const std::vector<Felt>& felt, double weight, Rows& rows) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    const DeformationConstraint& one = constraints[i];
    const Eigen::Vector3d &source = one.source.position, &target = one.target.position;
    Eigen::Vector3d r = graph.shift(felt[i].source, source) - (target - source);
    if (one.relative) r -= graph.shift(felt[i].target, target);
    for (int m = 0; m < 3; ++m) {
      rows.begin(r(m), weight);
      addMotion(graph, felt[i].source, source, m, 1, rows);
      if (one.relative) addMotion(graph, felt[i].target, target, m, -1, rows);
    }
    if (!one.pin) continue;
    const Eigen::Vector3d stray = graph.shift(felt[i].target, target);
    for (int m = 0; m < 3; ++m) {
      rows.begin(stray(m), weight);
      addMotion(graph, felt[i].target, target, m, 1, rows);
    }
  }
}

Rows linearise(const DeformationGraph& graph, const std::vector<DeformationConstraint>& constraints,
               const std::vector<Felt>& felt, const std::vector<int>& columns) {
  Rows rows(columns);
  addRotation(graph, kRotationWeight, rows);
  addRegularisation(graph, kRegularisationWeight, rows);
  addConstraints(graph, constraints, felt, kConstraintWeight, rows);
  return rows;
}

double costOf(const Rows& rows) {
  double cost = 0;
  for (const double r : rows.residuals()) cost += r * r;
  return cost;
}

double meanError(const DeformationGraph& graph, const std::vector<DeformationConstraint>& constraints,
                 const std::vector<Felt>& felt) {
  double sum = 0;
  for (size_t i = 0; i < constraints.size(); ++i) {
    Eigen::Vector3d r = graph.shift(felt[i].source, constraints[i].source.position) -
                        (constraints[i].target.position - constraints[i].source.position);
    if (constraints[i].relative) r -= graph.shift(felt[i].target, constraints[i].target.position);
    sum += r.norm();
  }
  return sum / static_cast<double>(constraints.size());
}

}  // namespace

DeformationSolve solveDeformation(DeformationGraph& graph, const std::vector<DeformationConstraint>& constraints,
                                  const std::vector<bool>& frozen) {
  DeformationSolve result;
  auto& nodes = graph.nodes();
  std::vector<int> columns(nodes.size(), -1);
  int unknowns = 0;
  for (size_t n = 0; n < nodes.size(); ++n) {
    if (!frozen.empty() && frozen[n]) continue;
    columns[n] = unknowns;
    unknowns += kUnknowns;
  }
  if (unknowns == 0 || constraints.empty()) return result;
  std::vector<Felt> felt;
  for (const DeformationConstraint& one : constraints)
    felt.push_back({graph.influence(one.source), graph.influence(one.target)});
  result.start_error_m = meanError(graph, constraints, felt);

  Rows rows = linearise(graph, constraints, felt, columns);
  result.cost = costOf(rows);
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
  Eigen::SparseMatrix<double> damping(unknowns, unknowns);
  damping.setIdentity();
  damping *= 1e-9;  // nodes that nothing but their own rotation speaks of
  for (int i = 0; i < kIterations; ++i) {
    Eigen::SparseMatrix<double> J(static_cast<int>(rows.residuals().size()), unknowns);
    J.setFromTriplets(rows.entries().begin(), rows.entries().end());
    const Eigen::Map<const Eigen::VectorXd> r(rows.residuals().data(), static_cast<long>(rows.residuals().size()));
    const Eigen::SparseMatrix<double> A = Eigen::SparseMatrix<double>(J.transpose() * J) + damping;
    if (i == 0) solver.analyzePattern(A);
    solver.factorize(A);
    if (solver.info() != Eigen::Success) return result;
    const Eigen::VectorXd step = solver.solve(-(J.transpose() * r));
    if (!step.allFinite()) return result;
    const auto before = nodes;
    for (size_t n = 0; n < nodes.size(); ++n) {
      if (columns[n] < 0) continue;
      for (int c = 0; c < 3; ++c) nodes[n].A.col(c) += step.segment<3>(columns[n] + 3 * c);
      nodes[n].b += step.segment<3>(columns[n] + 9);
    }
    Rows next = linearise(graph, constraints, felt, columns);
    const double cost = costOf(next);
    if (cost > result.cost) {
      nodes = before;
      break;
    }
    const double gain = result.cost - cost;
    rows = std::move(next);
    result.cost = cost;
    if (gain <= 1e-5 * cost || step.norm() < 1e-9) break;
  }
  result.mean_error_m = meanError(graph, constraints, felt);
  result.solved = true;
  return result;
}

}  // namespace comap
