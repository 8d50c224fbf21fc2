// The poses of maps as a pure function of what holds: the same however it came to be.
#pragma once

#include <map>
#include <set>

#include "mapping_core/graph/keyframe_graph.h"
#include "mapping_core/merge/standing.h"

namespace comap {

/// Poses in their maps of all keyframes of the components anchored at `anchors`. Chains of odometry are laid out from
/// their first keyframes; then map joins map in order of the merges, each solved before it joins; then each map is
/// solved with all its edges. Errors as optimiseGraph's.
Result<std::map<KeyframeId, Pose>> canonicalPoses(const Standing& standing, const std::set<KeyframeId>& anchors,
                                                  const GraphOptions& options);

}  // namespace comap
