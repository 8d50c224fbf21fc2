// The keyframe graph of one map, kept solved while it grows: each new edge costs about what it bends, not the whole.
// Poses start from the last solution; clusters of keyframes move as rigid bodies except where the graph strains, and
// there pose by pose, until no pose wants to move by more than the tolerance. Every edge but odometry is used only if
// the rest of the graph can agree with it (truncated least squares); what was rejected is asked again.
#pragma once

#include <array>
#include <map>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "mapping_core/graph/graph_clusters.h"
#include "mapping_core/graph/graph_problem.h"
#include "mapping_core/graph/keyframe_graph.h"

namespace comap {

struct GraphSolverOptions {
  GraphOptions graph;
  double settled_m = 0.00003, settled_rad = 0.00001;  ///< a pose that would move by less alone is at rest
  size_t free_poses = 500;                            ///< at a time; the rest of what strains waits for the next round
  size_t free_poses_of_all = 800;                     ///< the same in solveFully(), where the sum of all rounds counts
  int rounds = 3;                                     ///< of moving poses for each question that solve() asks
  int enough_rounds = 3;                              ///< of a call of solve(): what can wait is left to the next one
  bool calibrate = true;                              ///< estimate a scale per edge kind in solveFully()
};

/// Names an edge: at most one of a kind between two keyframes in one direction.
struct EdgeKey {
  EdgeKind kind = EdgeKind::kOdometry;
  KeyframeId from, to;
  auto operator<=>(const EdgeKey&) const = default;
};
EdgeKey keyOf(const Edge& edge);

struct GraphUpdate {
  uint64_t revision = 0;                 ///< number of changes (keyframes, edges) that the solution knows
  bool settled = false;                  ///< false: solving again would move poses further
  std::map<KeyframeId, Pose> T_map_cam;  ///< of all keyframes
  std::vector<EdgeKey> used, rejected;   ///< edges whose state changed in this call
  std::array<double, kEdgeKinds> scale{1, 1, 1, 1};
  int rounds = 0, iterations = 0;
};

/// Deterministic: the same calls give the same bits. Thread rule: one thread.
class GraphSolver {
 public:
  explicit GraphSolver(const GraphSolverOptions& options = {});
  GraphSolver(const GraphSolver&) = delete;
  GraphSolver& operator=(const GraphSolver&) = delete;

  /// The first keyframe is the anchor and stays where it is. `hangs_on`, if known, is the keyframe before it. kBadData
  /// if the keyframe is known or its pose is not finite.
  Result<void> addKeyframe(const KeyframeId& id, const Pose& T_map_cam, const std::optional<KeyframeId>& hangs_on = {});
  /// An edge of the same key is replaced. kBadData if an end is unknown, both ends are one, the pose is not finite or
  /// the information is not positive semidefinite.
  Result<void> addEdge(const Edge& edge);
  /// An edge that the poses know already: it takes part if it fits them, and solve() need not begin with it. Errors as
  /// addEdge().
  Result<void> addSettled(const Edge& edge);
  /// False if there is no such edge.
  bool removeEdge(const EdgeKey& key);

  /// Brings the graph to rest after the changes since the last call, with bounded work: see GraphUpdate::settled.
  /// kProblem if the solver fails; poses are then as before.
  Result<GraphUpdate> solve();
  /// All poses, all rejections and the scales anew, from where the graph stands. Takes its time.
  Result<GraphUpdate> solveFully();

  size_t keyframes() const { return ids_.size(); }
  size_t edges() const { return edge_of_.size(); }
  uint64_t revision() const { return revision_; }
  Pose pose(const KeyframeId& id) const;
  /// Whether the edge takes part; false also if unknown.
  bool uses(const EdgeKey& key) const;
  /// Sum of squared residuals of used edges, and the gate for every rejected one: what solving makes small.
  double robustCost() const;
  /// Squared residuals of a kind's used edges over what their number lets expect, robustly; nullopt if too few.
  std::optional<double> chi2PerFreedom(EdgeKind kind) const;

 private:
  struct State {
    std::vector<GraphProblem::Block> blocks;
    std::vector<double> weights;
    std::vector<uint32_t> changes;  // of clusters
  };

  State state() const { return {graph_.blocks(), graph_.weights(), clusters_.changes()}; }
  void restore(const State& state);
  bool hasDoneEnough() const { return rounds_ >= options_.enough_rounds; }
  bool gated(uint32_t edge) const { return graph_.edge(edge).kind != EdgeKind::kOdometry; }
  bool fits(uint32_t edge) const { return graph_.chi2(edge) <= options_.graph.gate_chi2; }
  void setWeight(uint32_t edge, double weight);
  std::vector<uint8_t> clustersOf(std::span<const uint32_t> edges) const;

  Result<bool> relax(std::vector<uint8_t> active);
  Result<bool> relax(std::vector<uint8_t> active, int max_rounds, size_t free_poses);
  Result<bool> relaxAll();
  void noteMotion(const std::vector<GraphProblem::Block>& before, const std::vector<uint8_t>& active);
  std::vector<uint8_t> strained(const std::vector<uint8_t>& active, size_t free_poses);

  std::vector<uint32_t> screen(const std::vector<uint32_t>& fresh);
  Result<void> judge(std::vector<uint32_t> trial, const State& before);
  Result<void> dropConflicts(std::vector<uint32_t> spared);
  std::vector<uint32_t> conflicts() const;
  Result<void> readmit();
  Result<void> hearTheRejected();
  std::vector<uint32_t> agreeing(uint32_t edge) const;
  Result<void> sharpenAll();
  bool calibrate();
  GraphUpdate update(const std::vector<double>& weights_before, bool settled) const;

  GraphSolverOptions options_;
  GraphProblem graph_;
  GraphClusters clusters_;
  std::vector<KeyframeId> ids_;
  std::map<KeyframeId, uint32_t> number_of_;
  std::map<EdgeKey, uint32_t> edge_of_;
  std::vector<EdgeKey> keys_;     // per edge number
  std::vector<uint8_t> removed_;  // per edge number
  std::set<uint32_t> rejected_;
  std::vector<uint32_t> fresh_;       // edges since the last solve
  std::vector<uint32_t> unheard_;     // refused ones that have not been heard with those that say the same
  bool readmission_due_ = false;      // poses have moved since the rejected were asked
  std::set<uint32_t> restless_;       // clusters that still strain
  std::vector<uint8_t> poses_moved_;  // against a neighbour, since last looked at for strain
  std::vector<uint8_t> edges_moved_;  // in this call
  uint64_t revision_ = 0;
  int rounds_ = 0, iterations_ = 0;
};

}  // namespace comap
