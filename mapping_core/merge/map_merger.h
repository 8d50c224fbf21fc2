// How two maps lie to each other when several closures say so, before the joint solve.
#pragma once

#include <map>
#include <span>

#include "mapping_core/graph/closure.h"
#include "protocol/types/pose.h"

namespace comap {

/// T_a_b of the map of the closures' candidates (a) and that of their queries (b): the mean, weighted by each closure's
/// agreement with the others (Huber at 3 cm), taken where the queries stand so that rotation does not lever.
Pose averageTransform(std::span<const Closure> closures, const std::map<KeyframeId, Pose>& T_map_cam);

}  // namespace comap
