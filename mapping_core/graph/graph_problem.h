// Poses and edges by number, and Ceres over any part of them: the poses asked for move, the rest stays.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mapping_core/graph/edge.h"
#include "protocol/types/result.h"

namespace comap {

struct GraphSolveLimits {
  int max_iterations = 50;
  double function_tolerance = 1e-8;  ///< relative decrease of the cost that ends it
  double trust_radius = 1e4;  ///< of the first step: large if poses start near the solution, so that long chains bend
};

/// Thread rule: one thread. Numbers are positions in order of addition; the caller gives only valid ones.
class GraphProblem {
 public:
  static constexpr int kAmbient = 7;  ///< quaternion x y z w, translation
  using Block = std::array<double, kAmbient>;

  struct BuiltEdge {
    uint32_t from = 0, to = 0;
    EdgeKind kind = EdgeKind::kOdometry;
    Pose T_from_to;
    Matrix6d root;  ///< whitens the increment
  };

  uint32_t addPose(const Pose& T_map_cam);
  uint32_t addEdge(const BuiltEdge& edge);

  size_t poses() const { return blocks_.size(); }
  size_t edges() const { return edges_.size(); }
  const BuiltEdge& edge(uint32_t number) const { return edges_[number]; }
  /// Edges at a pose, those of weight 0 included.
  std::span<const uint32_t> edgesAt(uint32_t pose) const { return edges_at_[pose]; }
  Pose pose(uint32_t number) const;
  void setPose(uint32_t number, const Pose& T_map_cam);
  const std::vector<Block>& blocks() const { return blocks_; }
  void setBlocks(std::vector<Block> blocks) { blocks_ = std::move(blocks); }

  /// In [0, 1]; an edge of weight 0 is not in the problem.
  double weight(uint32_t edge) const { return weights_[edge]; }
  const std::vector<double>& weights() const { return weights_; }
  void setWeight(uint32_t edge, double weight);
  void replaceEdge(uint32_t number, const Pose& T_from_to, const Matrix6d& root);
  /// How many times too small the covariances of a kind were given; 1 at first.
  double scale(EdgeKind kind) const { return scales_[static_cast<size_t>(kind)]; }
  void setScale(EdgeKind kind, double scale);

  /// Squared residual of an edge in units of its (scaled) covariance, whatever its weight.
  double chi2(uint32_t edge) const;
  /// Half the weighted sum of all.
  double cost() const;
  /// Variance of an edge (scaled), in square metres, of a point at some distance from its ends; infinite if the edge
  /// leaves all translation or all rotation open.
  double spread(uint32_t edge) const { return scale(edges_[edge].kind) * spreads_[edge]; }
  /// For each pose that is asked for (not 0): the step (rho, phi) that would bring it alone to its optimum, all others
  /// held.
  std::vector<Vector6d> relaxingSteps(const std::vector<uint8_t>& asked);

  /// Moves the poses of `free` to the least cost of all edges that touch one of them; the others are held. Returns the
  /// number of iterations; kProblem if the solver fails.
  Result<int> solve(std::span<const uint32_t> free, const GraphSolveLimits& limits);

 private:
  void forgetStiffness(uint32_t edge);
  void findStiffness(uint32_t pose);

  std::vector<Block> blocks_;
  std::vector<BuiltEdge> edges_;
  std::vector<double> weights_;
  std::vector<double> spreads_;  // per edge, not scaled
  std::vector<std::vector<uint32_t>> edges_at_;
  // Per pose, inverse of the Hessian by it alone, where known: it hardly changes while increments are small.
  std::vector<Matrix6d> yields_;
  std::vector<uint8_t> yields_known_;
  std::array<double, kEdgeKinds> scales_{1, 1, 1, 1};
};

}  // namespace comap
