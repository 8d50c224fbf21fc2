#include "mapping_core/merge/canonical_poses.h"

#include <algorithm>

#include "mapping_core/merge/map_merger.h"

namespace comap {
namespace {

// Maps on their way to what holds: first chains, then more and more of them joined.
class Layout {
 public:
  Layout(const std::vector<KeyframeId>& sorted_keyframes, const std::vector<Edge>& edges, const GraphOptions& options)
      : edges_(edges), options_(options) {
    for (const KeyframeId& keyframe : sorted_keyframes) components_.addAlone(keyframe);
    std::map<KeyframeId, const Edge*> odometry_to;
    for (const Edge& edge : edges)
      if (edge.kind == EdgeKind::kOdometry) odometry_to[edge.to] = &edge;
    for (const KeyframeId& keyframe : sorted_keyframes) {  // of a chain, the earlier come first
      const auto edge = odometry_to.find(keyframe);
      if (edge == odometry_to.end()) {
        T_map_cam_[keyframe] = Pose();
        continue;
      }
      T_map_cam_[keyframe] = T_map_cam_.at(edge->second->from) * edge->second->T_from_to;
      components_.join(edge->second->from, keyframe);
    }
  }

  // Odometry alone leaves nothing to solve: such a map stays as it was laid out, to the bit.
  Result<void> solve(const KeyframeId& anchor) {
    if (!solved_.insert(anchor).second) return {};
    std::vector<Edge> edges;
    bool loops = false;
    for (const Edge& edge : edges_) {
      if (!components_.together(edge.from, anchor) || !components_.together(edge.to, anchor)) continue;
      edges.push_back(edge);
      loops = loops || edge.kind != EdgeKind::kOdometry;
    }
    if (!loops) return {};
    std::map<KeyframeId, Pose> initial;
    for (const KeyframeId& member : components_.members(anchor)) initial[member] = T_map_cam_.at(member);
    const auto solution = optimiseGraph(initial, edges, anchor, options_);
    if (!solution) return solution.error();
    for (const auto& [id, T] : solution->T_map_cam) T_map_cam_.at(id) = T;
    return {};
  }

  Result<void> join(const std::vector<Edge>& closures) {
    const KeyframeId a = components_.anchorOf(closures.front().from), b = components_.anchorOf(closures.front().to);
    if (a == b) return {};
    for (const KeyframeId& side : {a, b})
      if (auto solved = solve(side); !solved) return solved;
    solved_.erase(a);
    solved_.erase(b);
    std::vector<Closure> from_b_to_a;
    for (const Edge& edge : closures) {
      const bool turned = !components_.together(edge.from, a);
      from_b_to_a.push_back(turned ? Closure{edge.from, edge.to, edge.T_from_to.inverse(), edge.information}
                                   : Closure{edge.to, edge.from, edge.T_from_to, edge.information});
    }
    const Pose T_a_b = averageTransform(from_b_to_a, T_map_cam_);
    const std::vector<KeyframeId> members_a = components_.members(a), members_b = components_.members(b);
    const bool keeps_a = components_.join(a, b)->first == a;
    const Pose T_kept_absorbed = keeps_a ? T_a_b : T_a_b.inverse();
    for (const KeyframeId& id : keeps_a ? members_b : members_a)
      T_map_cam_.at(id) = T_kept_absorbed * T_map_cam_.at(id);
    return {};
  }

  std::vector<KeyframeId> anchors() const { return components_.anchors(); }
  std::map<KeyframeId, Pose> takePoses() { return std::move(T_map_cam_); }

 private:
  const std::vector<Edge>& edges_;
  const GraphOptions& options_;
  ComponentSet components_;
  std::set<KeyframeId> solved_;  // anchors
  std::map<KeyframeId, Pose> T_map_cam_;
};

}  // namespace

Result<std::map<KeyframeId, Pose>> canonicalPoses(const Standing& standing, const std::set<KeyframeId>& anchors,
                                                  const GraphOptions& options) {
  const auto wanted = [&](const KeyframeId& keyframe) {
    return anchors.contains(standing.components.anchorOf(keyframe));
  };
  std::vector<KeyframeId> keyframes;
  for (const KeyframeId& anchor : anchors)
    for (KeyframeId& member : standing.components.members(anchor)) keyframes.push_back(std::move(member));
  std::sort(keyframes.begin(), keyframes.end());
  std::vector<Edge> edges;
  std::copy_if(standing.edges.begin(), standing.edges.end(), std::back_inserter(edges),
               [&](const Edge& edge) { return wanted(edge.from); });

  Layout layout(keyframes, edges, options);
  for (const Join& join : standing.joins)
    if (wanted(join.closures.front().from))
      if (auto joined = layout.join(join.closures); !joined) return joined.error();
  for (const KeyframeId& anchor : layout.anchors())
    if (auto solved = layout.solve(anchor); !solved) return solved.error();
  return layout.takePoses();
}

}  // namespace comap
