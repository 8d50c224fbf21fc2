// A deformation graph of a whole map: sampled from its surfels, applied to them.
#pragma once

#include "mapping_core/paper/deformation_graph.h"
#include "mapping_core/surfels/timed_surfel_map.h"

namespace comap {

/// A node every `stride` surfels, farther apart if there would be more than `most` nodes. `owners` tells when each
/// surfel was made.
DeformationGraph sampleGraph(const std::vector<TimedSurfel>& surfels, const std::vector<FrameTime>& owners,
                             size_t stride, size_t most, NodeOrder order);

/// Moves all surfels but those made at `tick`.
Result<void> deformMap(TimedSurfelMap& map, const std::vector<FrameTime>& owners, const DeformationGraph& graph,
                       uint32_t tick);

}  // namespace comap
