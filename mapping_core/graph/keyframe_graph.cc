#include "mapping_core/graph/keyframe_graph.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "mapping_core/graph/edge_information.h"
#include "mapping_core/graph/edge_residual.h"
#include "mapping_core/graph/loop_weights.h"

namespace comap {
namespace {

constexpr int kAmbient = 7;  // quaternion x y z w, translation
constexpr int kTangent = 6;  // d of T exp(d): rho, phi
constexpr int kMaxSharpenings = 100;
constexpr int kIterationsPerSharpening = 4;  // each starts from the last one's solution
constexpr int kIterationsBeforeSharpening = 25;
constexpr int kMaxReadmissions = 10;

using Block = std::array<double, kAmbient>;

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
  EdgeCost(const Pose& T_from_to, const Matrix6d& root, const double* weight)
      : T_from_to_(T_from_to), root_(root), weight_(weight) {}

  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Matrix6d root = std::sqrt(*weight_) * root_;
    const Pose T_map_from = toPose(x[0]), T_map_to = toPose(x[1]);
    Eigen::Map<Vector6d> r(residual);
    if (jacobians == nullptr) {
      r = root * edgeIncrement(T_map_from, T_map_to, T_from_to_);
      return true;
    }
    const EdgeResidual edge = edgeResidual(T_map_from, T_map_to, T_from_to_);
    r = root * edge.increment;
    const Matrix6d* const derivatives[2] = {&edge.d_from, &edge.d_to};
    for (int side = 0; side < 2; ++side) {
      if (jacobians[side] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 6, kAmbient, Eigen::RowMajor>> j(jacobians[side]);
      j.leftCols<6>() = root * *derivatives[side];
      j.rightCols<1>().setZero();
    }
    return true;
  }

 private:
  Pose T_from_to_;
  Matrix6d root_;
  const double* weight_;  // changes between solves
};

std::string describe(const Edge& edge) { return "edge from " + toString(edge.from) + " to " + toString(edge.to); }

Result<void> check(const std::map<KeyframeId, Pose>& initial, std::span<const Edge> edges, const KeyframeId& anchor) {
  if (!initial.contains(anchor)) {
    return Error{ErrorCode::kBadData, "anchor " + toString(anchor) + " has no initial pose"};
  }
  for (const auto& [id, pose] : initial) {
    if (!pose.isFinite()) return Error{ErrorCode::kBadData, "initial pose of " + toString(id) + " is not finite"};
  }
  for (const Edge& edge : edges) {
    for (const KeyframeId* end : {&edge.from, &edge.to}) {
      if (!initial.contains(*end)) {
        return Error{ErrorCode::kBadData, describe(edge) + ": " + toString(*end) + " has no initial pose"};
      }
    }
    if (edge.from == edge.to) return Error{ErrorCode::kBadData, describe(edge) + ": both ends are one keyframe"};
    if (!edge.T_from_to.isFinite()) return Error{ErrorCode::kBadData, describe(edge) + ": its pose is not finite"};
  }
  return {};
}

// The problem with its poses and weights: solved again and again from where it stands.
class GraphProblem {
 public:
  static Result<std::unique_ptr<GraphProblem>> build(const std::map<KeyframeId, Pose>& initial,
                                                     std::span<const Edge> edges, const KeyframeId& anchor,
                                                     const GraphOptions& options) {
    auto graph = std::unique_ptr<GraphProblem>(new GraphProblem);
    std::map<KeyframeId, size_t> index;
    graph->blocks_.resize(initial.size());  // never grows again: Ceres keeps the addresses
    for (const auto& [id, pose] : initial) {
      const size_t i = index.size();
      index.emplace(id, i);
      fromPose(pose, graph->blocks_[i].data());
      graph->problem_.AddParameterBlock(graph->blocks_[i].data(), kAmbient, &graph->manifold_);
    }
    graph->problem_.SetParameterBlockConstant(graph->blocks_[index.at(anchor)].data());

    graph->weights_.assign(edges.size(), 1.0);
    graph->edges_.reserve(edges.size());
    graph->terms_.assign(edges.size(), nullptr);
    for (size_t i = 0; i < edges.size(); ++i) {
      const Edge& edge = edges[i];
      Result<Matrix6d> root = squareRootInformation(edge.information, options.sigma_floor_m, options.sigma_floor_rad);
      if (!root) return Error{root.error().code, describe(edge) + ": " + root.error().text};
      const size_t from = index.at(edge.from), to = index.at(edge.to);
      graph->edges_.push_back({from, to, edge.T_from_to, *root});
    }
    return graph;
  }

  double chi2(size_t edge) const {
    const BuiltEdge& e = edges_[edge];
    return (e.root * edgeIncrement(pose(e.from), pose(e.to), e.T_from_to)).squaredNorm();
  }
  double cost() const {
    double sum = 0;
    for (size_t i = 0; i < edges_.size(); ++i) sum += 0.5 * weights_[i] * chi2(i);
    return sum;
  }
  Pose pose(size_t keyframe) const { return toPose(blocks_[keyframe].data()); }
  std::vector<double>& weights() { return weights_; }

  Result<void> solve(int max_iterations, int& iterations) {
    syncTerms();
    ceres::Solver::Options options;
    options.max_num_iterations = max_iterations;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // no BLAS threads: the same bits every time
    options.num_threads = 1;
    options.function_tolerance = 1e-8;
    options.gradient_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    iterations += summary.num_successful_steps + summary.num_unsuccessful_steps;
    if (!summary.IsSolutionUsable()) {
      return Error{ErrorCode::kProblem, "the graph of " + std::to_string(blocks_.size()) + " keyframes and " +
                                            std::to_string(edges_.size()) +
                                            " edges was not solved: " + summary.message};
    }
    return {};
  }

 private:
  struct BuiltEdge {
    size_t from, to;
    Pose T_from_to;
    Matrix6d root;
  };
  // Rejected edges leave the problem: one across the map would fill the factorisation even at weight 0.
  void syncTerms() {
    for (size_t i = 0; i < edges_.size(); ++i) {
      const BuiltEdge& e = edges_[i];
      if (weights_[i] > 0 && terms_[i] == nullptr) {
        terms_[i] = problem_.AddResidualBlock(new EdgeCost(e.T_from_to, e.root, &weights_[i]), nullptr,
                                              blocks_[e.from].data(), blocks_[e.to].data());
      } else if (weights_[i] <= 0 && terms_[i] != nullptr) {
        problem_.RemoveResidualBlock(terms_[i]);
        terms_[i] = nullptr;
      }
    }
  }
  static ceres::Problem::Options problemOptions() {
    ceres::Problem::Options options;
    options.enable_fast_removal = true;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  GraphProblem() : problem_(problemOptions()) {}

  PoseManifold manifold_;
  std::vector<Block> blocks_;
  std::vector<double> weights_;
  std::vector<BuiltEdge> edges_;
  std::vector<ceres::ResidualBlockId> terms_;  // per edge, null if out
  ceres::Problem problem_;                     // last: goes before what it points to
};

// Sharpens until every loop is either in or out. Leaves weights of 0 and 1.
Result<void> rejectFalseLoops(GraphProblem& graph, const std::vector<size_t>& loops, const GraphOptions& options,
                              int& iterations) {
  std::vector<double> chi2(loops.size());
  const auto measure = [&] {
    for (size_t i = 0; i < loops.size(); ++i) chi2[i] = graph.chi2(loops[i]);
  };
  measure();
  double mu = initialSharpness(chi2, options.gate_chi2);
  if (mu > 0) {
    for (int step = 0; step < kMaxSharpenings; ++step, mu *= kSharpening) {
      bool decided = true;
      for (size_t i = 0; i < loops.size(); ++i) {
        double& weight = graph.weights()[loops[i]];
        weight = loopWeight(chi2[i], options.gate_chi2, mu);
        decided = decided && (weight == 0 || weight == 1);
      }
      if (Result<void> solved = graph.solve(kIterationsPerSharpening, iterations); !solved) return solved;
      measure();
      if (decided) break;
    }
  }
  // In or out by the gate itself; what was thrown out early may fit now that the false ones no longer pull.
  for (int round = 0; round < kMaxReadmissions; ++round) {
    bool changed = false;
    for (size_t i = 0; i < loops.size(); ++i) {
      double& weight = graph.weights()[loops[i]];
      const double decision = chi2[i] <= options.gate_chi2 ? 1.0 : 0.0;
      changed = changed || weight != decision;
      weight = decision;
    }
    if (!changed) break;
    if (Result<void> solved = graph.solve(options.max_iterations, iterations); !solved) return solved;
    measure();
  }
  return {};
}

}  // namespace

Result<GraphSolution> optimiseGraph(const std::map<KeyframeId, Pose>& initial, std::span<const Edge> edges,
                                    const KeyframeId& anchor, const GraphOptions& options) {
  if (Result<void> checked = check(initial, edges, anchor); !checked) return checked.error();
  Result<std::unique_ptr<GraphProblem>> built = GraphProblem::build(initial, edges, anchor, options);
  if (!built) return built.error();
  GraphProblem& graph = **built;

  GraphSolution solution;
  solution.initial_cost = graph.cost();
  std::vector<size_t> loops;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (edges[i].kind != EdgeKind::kOdometry) loops.push_back(i);
  }
  if (options.reject_loops && !loops.empty()) {
    const int first = std::min(options.max_iterations, kIterationsBeforeSharpening);
    if (Result<void> solved = graph.solve(first, solution.iterations); !solved) return solved.error();
    if (Result<void> r = rejectFalseLoops(graph, loops, options, solution.iterations); !r) return r.error();
  }
  if (Result<void> solved = graph.solve(options.max_iterations, solution.iterations); !solved) return solved.error();

  solution.final_cost = graph.cost();
  solution.edge_weight = graph.weights();
  size_t i = 0;
  for (const auto& [id, pose] : initial) {
    solution.T_map_cam.emplace(id, id == anchor ? pose : graph.pose(i));
    if (!solution.T_map_cam.at(id).isFinite()) {
      return Error{ErrorCode::kProblem, "the solver left keyframe " + toString(id) + " at a pose that is not finite"};
    }
    ++i;
  }
  return solution;
}

}  // namespace comap
