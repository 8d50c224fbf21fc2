// What holds, of all that was ever accepted: which maps are one, by which merges and edges. A pure function of the
// records, so that a core that lives, one that was restarted and a store at rest agree.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mapping_core/merge/component.h"
#include "protocol/types/messages.h"

namespace comap {

/// Two maps become one: by closures that all lie between these two.
struct Join {
  uint32_t merge = 0;
  std::vector<Edge> closures;  ///< in canonical order
};

/// Which maps there are.
struct Shape {
  ComponentSet components;
  std::vector<Join> joins;            ///< in order of the merges' numbers
  std::vector<uint32_t> unsupported;  ///< merges that were not undone, but too few of whose closures are left
};

struct Standing : Shape {
  std::vector<Edge> edges;  ///< that hold, in canonical order: by later keyframe, earlier keyframe, kind
  std::vector<Edge> apart;  ///< the others: the maps they tie are not one
};

/// `keyframes` in order of arrival; `edges`: all but those withdrawn; `merges` in order of their numbers, those undone
/// are passed over. Odometry ties keyframes, merges tie maps: a merge joins the two maps that most of its closures lie
/// between, if there are `votes_needed` (or all, if it once had fewer). Every other edge holds if its ends are in one
/// map. An edge of a keyframe that is not among `keyframes` counts as apart.
Standing standingOf(std::span<const KeyframeId> keyframes, std::span<const Edge> edges,
                    std::span<const MergeRecord> merges, size_t votes_needed);

/// What of it edges without measurements tell: those of odometry, and closures of merges, are enough.
Shape shapeOf(std::span<const KeyframeId> keyframes, std::span<const Edge> edges, std::span<const MergeRecord> merges,
              size_t votes_needed);

/// The two maps that there would be without `merge`: the keyframes on its closures' sides, that of the smaller anchor
/// first. Nothing if the merge does not join anything now, or if its sides would be one map without it.
std::optional<std::pair<std::vector<KeyframeId>, std::vector<KeyframeId>>> sidesOf(
    uint32_t merge, std::span<const KeyframeId> keyframes, std::span<const Edge> edges,
    std::span<const MergeRecord> merges, size_t votes_needed);

}  // namespace comap
