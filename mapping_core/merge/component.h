// Components: sets of keyframes tied by accepted edges. Each is one map with one frame of reference.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "mapping_core/graph/edge.h"

namespace comap {

/// A chain is a run of keyframes of one robot linked by odometry; chains are what merges join.
/// Handles stay valid through merges (union-find with path halving); the kept map is that whose anchor
/// (first keyframe) is smallest, so the result does not depend on arrival order of votes.
class ComponentSet {
 public:
  /// So many keyframes are to come.
  void reserve(size_t keyframes) { index_.reserve(keyframes); }
  /// Adds a keyframe as a new component of its own, anchored at it.
  void addAlone(const KeyframeId& keyframe);
  /// Adds a keyframe into the component of `neighbour`.
  void addTo(const KeyframeId& keyframe, const KeyframeId& neighbour);
  /// Joins the components of a and b; returns {kept anchor, absorbed anchor}, or nothing if they are one already.
  std::optional<std::pair<KeyframeId, KeyframeId>> join(const KeyframeId& a, const KeyframeId& b);

  bool contains(const KeyframeId& keyframe) const;
  /// The component's anchor, which names it.
  KeyframeId anchorOf(const KeyframeId& keyframe) const;
  bool together(const KeyframeId& a, const KeyframeId& b) const;
  /// Anchors of all components, sorted.
  std::vector<KeyframeId> anchors() const;
  /// Keyframes of a component in order of addition.
  std::vector<KeyframeId> members(const KeyframeId& anchor) const;
  /// Robot names in a component, sorted.
  std::vector<std::string> robots(const KeyframeId& anchor) const;

 private:
  size_t rootOf(size_t index) const;
  struct Hash {
    size_t operator()(const KeyframeId& id) const;
  };
  std::unordered_map<KeyframeId, size_t, Hash> index_;
  std::vector<KeyframeId> keyframes_;       // in order of addition
  mutable std::vector<size_t> parent_;      // union-find
  std::vector<KeyframeId> anchor_of_root_;  // valid at roots
};

}  // namespace comap
