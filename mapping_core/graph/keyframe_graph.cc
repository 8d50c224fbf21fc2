#include "mapping_core/graph/keyframe_graph.h"

#include <algorithm>

#include "mapping_core/graph/edge_information.h"
#include "mapping_core/graph/graph_problem.h"
#include "mapping_core/graph/loop_weights.h"

namespace comap {
namespace {

constexpr int kMaxSharpenings = 100;
constexpr double kTolerance = 1e-8;
constexpr GraphSolveLimits kWhileSharpening{4, 1e-4};  // each starts from the last one's solution
constexpr int kIterationsBeforeSharpening = 25;
constexpr int kMaxReadmissions = 10;

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

// The whole graph, solved again and again from where it stands.
class WholeGraph {
 public:
  Result<void> build(const std::map<KeyframeId, Pose>& initial, std::span<const Edge> edges, const KeyframeId& anchor,
                     const GraphOptions& options) {
    std::map<KeyframeId, uint32_t> index;
    for (const auto& [id, pose] : initial) {
      const uint32_t number = problem.addPose(pose);
      index.emplace(id, number);
      if (id != anchor) free_.push_back(number);
    }
    for (const Edge& edge : edges) {
      Result<Matrix6d> root = squareRootInformation(edge, options);
      if (!root) return Error{root.error().code, describe(edge) + ": " + root.error().text};
      problem.addEdge({index.at(edge.from), index.at(edge.to), edge.kind, edge.T_from_to, *root});
    }
    return {};
  }
  Result<void> solve(const GraphSolveLimits& limits) {
    const auto ran = problem.solve(free_, limits);
    if (!ran) return ran.error();
    iterations += *ran;
    return {};
  }

  GraphProblem problem;
  int iterations = 0;

 private:
  std::vector<uint32_t> free_;
};

// Sharpens until every loop is either in or out. Leaves weights of 0 and 1.
Result<void> rejectFalseLoops(WholeGraph& graph, const std::vector<uint32_t>& loops, const GraphOptions& options) {
  std::vector<double> chi2(loops.size());
  const auto measure = [&] {
    for (size_t i = 0; i < loops.size(); ++i) chi2[i] = graph.problem.chi2(loops[i]);
  };
  measure();
  double mu = initialSharpness(chi2, options.gate_chi2);
  if (mu > 0) {
    for (int step = 0; step < kMaxSharpenings; ++step, mu *= kSharpening) {
      bool decided = true;
      for (size_t i = 0; i < loops.size(); ++i) {
        const double weight = loopWeight(chi2[i], options.gate_chi2, mu);
        graph.problem.setWeight(loops[i], weight);
        decided = decided && (weight == 0 || weight == 1);
      }
      if (Result<void> solved = graph.solve(kWhileSharpening); !solved) return solved;
      measure();
      if (decided) break;
    }
  }
  // In or out by the gate itself; what was thrown out early may fit now that the false ones no longer pull.
  for (int round = 0; round < kMaxReadmissions; ++round) {
    bool changed = false;
    for (size_t i = 0; i < loops.size(); ++i) {
      const double decision = chi2[i] <= options.gate_chi2 ? 1.0 : 0.0;
      changed = changed || graph.problem.weight(loops[i]) != decision;
      graph.problem.setWeight(loops[i], decision);
    }
    if (!changed) break;
    if (Result<void> solved = graph.solve({options.max_iterations, kTolerance}); !solved) return solved;
    measure();
  }
  return {};
}

}  // namespace

Result<GraphSolution> optimiseGraph(const std::map<KeyframeId, Pose>& initial, std::span<const Edge> edges,
                                    const KeyframeId& anchor, const GraphOptions& options) {
  if (Result<void> checked = check(initial, edges, anchor); !checked) return checked.error();
  WholeGraph graph;
  if (Result<void> built = graph.build(initial, edges, anchor, options); !built) return built.error();

  GraphSolution solution;
  solution.initial_cost = graph.problem.cost();
  std::vector<uint32_t> loops;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (edges[i].kind != EdgeKind::kOdometry) loops.push_back(static_cast<uint32_t>(i));
  }
  if (options.reject_loops && !loops.empty()) {
    const int first = std::min(options.max_iterations, kIterationsBeforeSharpening);
    if (Result<void> solved = graph.solve({first, kTolerance}); !solved) return solved.error();
    if (Result<void> rejected = rejectFalseLoops(graph, loops, options); !rejected) return rejected.error();
  }
  if (Result<void> solved = graph.solve({options.max_iterations, kTolerance}); !solved) return solved.error();

  solution.final_cost = graph.problem.cost();
  solution.edge_weight = graph.problem.weights();
  solution.iterations = graph.iterations;
  uint32_t i = 0;
  for (const auto& [id, pose] : initial) {
    solution.T_map_cam.emplace(id, id == anchor ? pose : graph.problem.pose(i));
    if (!solution.T_map_cam.at(id).isFinite()) {
      return Error{ErrorCode::kProblem, "the solver left keyframe " + toString(id) + " at a pose that is not finite"};
    }
    ++i;
  }
  return solution;
}

}  // namespace comap
