#include "mapping_core/graph/graph_problem.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "mapping_core/graph/edge_residual.h"

namespace comap {
namespace {

constexpr int kAmbient = GraphProblem::kAmbient;
constexpr int kTangent = 6;     // d of T exp(d): rho, phi
constexpr double kLever_m = 3;  // a rotation's error counts as it shows at this distance

Pose toPose(const double* x) {
  return Pose(Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Map<const Eigen::Vector3d>(x + 4));
}

void fromPose(const Pose& pose, double* x) {
  Eigen::Map<Eigen::Quaterniond> rotation(x);
  Eigen::Map<Eigen::Vector3d> translation(x + 4);
  rotation = pose.rotation();
  translation = pose.translation();
}

// Costs give their derivatives by the tangent in the first six columns and zero in the seventh; with a plus-Jacobian
// of [I; 0] the product Ceres forms is the derivative by the tangent itself.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kAmbient; }
  int TangentSize() const override { return kTangent; }
  bool Plus(const double* x, const double* d, double* x_plus_d) const override {
    fromPose(toPose(x) * Pose::exp(Eigen::Map<const Vector6d>(d)), x_plus_d);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>> j(jacobian);
    j.setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d> d(y_minus_x);
    d = (toPose(x).inverse() * toPose(y)).log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kTangent, kAmbient, Eigen::RowMajor>> j(jacobian);
    j.setIdentity();
    return true;
  }
};

class EdgeCost final : public ceres::SizedCostFunction<6, kAmbient, kAmbient> {
 public:
  EdgeCost(const GraphProblem::BuiltEdge& edge, double weight) : edge_(edge), root_(std::sqrt(weight) * edge.root) {}

  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Pose T_map_from = toPose(x[0]), T_map_to = toPose(x[1]);
    Eigen::Map<Vector6d> r(residual);
    if (jacobians == nullptr) {
      r = root_ * edgeIncrement(T_map_from, T_map_to, edge_.T_from_to);
      return true;
    }
    const EdgeResidual edge = edgeResidual(T_map_from, T_map_to, edge_.T_from_to);
    r = root_ * edge.increment;
    const Matrix6d* const derivatives[2] = {&edge.d_from, &edge.d_to};
    for (int side = 0; side < 2; ++side) {
      if (jacobians[side] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 6, kAmbient, Eigen::RowMajor>> j(jacobians[side]);
      j.leftCols<6>() = root_ * *derivatives[side];
      j.rightCols<1>().setZero();
    }
    return true;
  }

 private:
  const GraphProblem::BuiltEdge& edge_;
  Matrix6d root_;
};

double spreadOf(const Matrix6d& root) {
  const double metres = root.leftCols<3>().squaredNorm(), radians = root.rightCols<3>().squaredNorm();
  if (metres <= 0 || radians <= 0) return std::numeric_limits<double>::infinity();
  return 1 / metres + kLever_m * kLever_m / radians;
}

ceres::Solver::Options solverOptions(const GraphSolveLimits& limits) {
  ceres::Solver::Options options;
  options.max_num_iterations = limits.max_iterations;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // no BLAS threads: the same bits every time
  options.num_threads = 1;
  options.function_tolerance = limits.function_tolerance;
  options.initial_trust_region_radius = limits.trust_radius;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

uint32_t GraphProblem::addPose(const Pose& T_map_cam) {
  blocks_.emplace_back();
  fromPose(T_map_cam, blocks_.back().data());
  edges_at_.emplace_back();
  yields_.emplace_back();
  yields_known_.push_back(0);
  return static_cast<uint32_t>(blocks_.size() - 1);
}

uint32_t GraphProblem::addEdge(const BuiltEdge& edge) {
  const auto number = static_cast<uint32_t>(edges_.size());
  edges_.push_back(edge);
  weights_.push_back(1);
  spreads_.push_back(spreadOf(edge.root));
  edges_at_[edge.from].push_back(number);
  edges_at_[edge.to].push_back(number);
  forgetStiffness(number);
  return number;
}

void GraphProblem::replaceEdge(uint32_t number, const Pose& T_from_to, const Matrix6d& root) {
  edges_[number].T_from_to = T_from_to;
  edges_[number].root = root;
  spreads_[number] = spreadOf(root);
  forgetStiffness(number);
}

Pose GraphProblem::pose(uint32_t number) const { return toPose(blocks_[number].data()); }
void GraphProblem::setPose(uint32_t number, const Pose& T_map_cam) { fromPose(T_map_cam, blocks_[number].data()); }

double GraphProblem::chi2(uint32_t edge) const {
  const BuiltEdge& e = edges_[edge];
  return (e.root * edgeIncrement(pose(e.from), pose(e.to), e.T_from_to)).squaredNorm() / scale(e.kind);
}

double GraphProblem::cost() const {
  double sum = 0;
  for (uint32_t i = 0; i < edges_.size(); ++i)
    if (weights_[i] > 0) sum += 0.5 * weights_[i] * chi2(i);
  return sum;
}

void GraphProblem::setWeight(uint32_t edge, double weight) {
  if (weights_[edge] == weight) return;
  weights_[edge] = weight;
  forgetStiffness(edge);
}

void GraphProblem::setScale(EdgeKind kind, double scale) {
  scales_[static_cast<size_t>(kind)] = scale;
  std::fill(yields_known_.begin(), yields_known_.end(), 0);
}

void GraphProblem::forgetStiffness(uint32_t edge) {
  yields_known_[edges_[edge].from] = yields_known_[edges_[edge].to] = 0;
}

void GraphProblem::findStiffness(uint32_t number) {
  Matrix6d hessian = Matrix6d::Zero();
  for (const uint32_t i : edges_at_[number]) {
    if (weights_[i] <= 0) continue;
    const BuiltEdge& e = edges_[i];
    const EdgeResidual r = edgeResidual(pose(e.from), pose(e.to), e.T_from_to);
    const Matrix6d j = e.root * (e.from == number ? r.d_from : r.d_to);
    hessian += weights_[i] / scale(e.kind) * j.transpose() * j;
  }
  hessian.diagonal().array() += 1e-9 * hessian.diagonal().maxCoeff() + 1e-12;
  yields_[number] = hessian.ldlt().solve(Matrix6d::Identity());
  yields_known_[number] = 1;
}

std::vector<Vector6d> GraphProblem::relaxingSteps(const std::vector<uint8_t>& asked) {
  std::vector<Vector6d> steps(blocks_.size(), Vector6d::Zero());
  for (uint32_t i = 0; i < edges_.size(); ++i) {
    const BuiltEdge& e = edges_[i];
    if (weights_[i] <= 0 || (!asked[e.from] && !asked[e.to])) continue;
    const Vector6d increment = edgeIncrement(pose(e.from), pose(e.to), e.T_from_to);
    const Vector6d pull = weights_[i] / scale(e.kind) * (e.root.transpose() * (e.root * increment));
    if (asked[e.from]) steps[e.from] += pulledBack(increment, pull);
    if (!asked[e.to]) continue;
    const Vector6d back = pulledBack(-increment, pull);  // and by the adjoint of T_from_to
    const Eigen::Vector3d force = back.head<3>(), torque = back.tail<3>();
    const Eigen::Quaterniond R_to_from = e.T_from_to.rotation().conjugate();
    steps[e.to].head<3>() -= R_to_from * force;
    steps[e.to].tail<3>() -= R_to_from * (torque - e.T_from_to.translation().cross(force));
  }
  for (uint32_t i = 0; i < blocks_.size(); ++i) {
    if (!asked[i]) continue;
    if (!yields_known_[i]) findStiffness(i);
    steps[i] = yields_[i] * steps[i].eval();
  }
  return steps;
}

Result<int> GraphProblem::solve(std::span<const uint32_t> free, const GraphSolveLimits& limits) {
  PoseManifold manifold;
  std::deque<EdgeCost> costs;  // Ceres keeps addresses
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);

  std::vector<uint8_t> state(blocks_.size(), 0);  // 1 = free, 2 = held and in the problem
  for (const uint32_t number : free) {
    state[number] = 1;
    problem.AddParameterBlock(blocks_[number].data(), kAmbient, &manifold);
  }
  for (const uint32_t number : free) {
    for (const uint32_t i : edges_at_[number]) {
      const BuiltEdge& e = edges_[i];
      const uint32_t other = e.from == number ? e.to : e.from;
      if (weights_[i] <= 0 || (state[other] == 1 && other < number)) continue;  // the other end brings it
      if (state[other] == 0) {
        problem.AddParameterBlock(blocks_[other].data(), kAmbient, &manifold);
        problem.SetParameterBlockConstant(blocks_[other].data());
        state[other] = 2;
      }
      costs.emplace_back(e, weights_[i] / scale(e.kind));
      problem.AddResidualBlock(&costs.back(), nullptr, blocks_[e.from].data(), blocks_[e.to].data());
    }
  }
  if (costs.empty()) return 0;
  ceres::Solver::Summary summary;
  ceres::Solve(solverOptions(limits), &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    return Error{ErrorCode::kProblem, "the graph of " + std::to_string(free.size()) + " free keyframes and " +
                                          std::to_string(costs.size()) + " edges was not solved: " + summary.message};
  }
  return summary.num_successful_steps + summary.num_unsuccessful_steps;
}

}  // namespace comap
