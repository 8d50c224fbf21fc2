// The graph at two resolutions at once: poses of active clusters by themselves, every other cluster as one rigid body.
// A correction that shifts half a building moves rigid bodies; what bends is solved pose by pose.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "mapping_core/graph/graph_problem.h"

namespace comap {

/// Clusters are runs of neighbours. All edges between two rigid bodies act as one, gathered once and kept until an edge
/// changes or a body's shape does. Thread rule: one thread. Refers to the graph it was made for.
class GraphClusters {
 public:
  static constexpr uint32_t kSize = 32;  ///< poses a cluster, at most

  explicit GraphClusters(GraphProblem& graph) : graph_(graph) {}

  /// The graph's next pose; it joins the cluster of `hangs_on` while there is room.
  void addPose(std::optional<uint32_t> hangs_on);
  /// The graph's next edge.
  void addEdge(uint32_t edge);
  /// The edge has changed its weight or content.
  void touchEdge(uint32_t edge);
  /// Poses of the cluster have moved against each other.
  void touchCluster(uint32_t cluster);
  void touchAll();
  /// Per cluster, how often its poses have moved against each other. After poses were set back, those clusters are to
  /// be touched whose number is not what it was.
  const std::vector<uint32_t>& changes() const { return changes_; }

  size_t size() const { return members_.size(); }
  uint32_t of(uint32_t pose) const { return cluster_[pose]; }
  const std::vector<uint32_t>& members(uint32_t cluster) const { return members_[cluster]; }

  /// Poses of active clusters (per cluster: not 0) move by themselves, others with their cluster; the pose `anchor`, or
  /// its whole cluster if that is rigid, is held. Returns the number of iterations.
  Result<int> solve(const std::vector<uint8_t>& active, uint32_t anchor, const GraphSolveLimits& limits);

 private:
  struct Link {
    uint32_t low = 0, high = 0;  // clusters
    std::vector<uint32_t> edges;
    bool gathered = false;
    std::optional<GraphProblem::BuiltEdge> edge;  // between the bodies' frames; none if no edge has a weight
  };

  Pose bodyFrame(uint32_t cluster) const { return graph_.pose(members_[cluster].front()); }
  void gather(Link& link) const;

  GraphProblem& graph_;
  std::vector<uint32_t> cluster_;               // per pose
  std::vector<std::vector<uint32_t>> members_;  // per cluster
  std::vector<uint32_t> changes_;               // per cluster
  std::vector<std::vector<uint32_t>> inner_;    // per cluster: edges within
  std::vector<std::vector<uint32_t>> links_at_;
  std::vector<Link> links_;
  std::unordered_map<uint64_t, uint32_t> link_of_;
};

}  // namespace comap
