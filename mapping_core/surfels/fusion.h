// One keyframe into the map: associate, update, clean up, insert. Removed surfels stay as marked gaps.
#pragma once

#include <span>
#include <vector>

#include "mapping_core/surfels/keyframe_maps.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/visible_list.h"

namespace comap {

/// Buffers that only live through one fusion.
struct FusionScratch {
  std::vector<VisibleList> visible;  ///< one per chunk in view
  gpu::Buffer blocks;                ///< u32 per block of a scan
  gpu::Buffer counters;              ///< updated and removed per chunk, then inserted
  size_t surfels = 0, chunks = 0;

  /// Room for chunks of these capacities, and for scans of `items`.
  Result<void> reserve(gpu::Context& context, std::span<const ChunkRows> chunks, size_t items);
};

struct FusionCounts {
  uint32_t updated = 0;
  std::vector<uint32_t> removed;  ///< per chunk
};

struct FusionStep {
  FramePush frame;
  std::span<const ChunkRows> seen;  ///< chunks that may hold something in view
  uint32_t owner = 0;
  uint32_t contributor = 0;
  const SeenStep* times = nullptr;  ///< of a timed map: whose surfels take part, and who sees them now
};

/// Finds which surfels the keyframe sees, and counts what it will insert; changes no surfel. `maps` holds the uploaded
/// images. kOutOfMemory if more than kMostSurfels rows are in `seen`.
Result<uint32_t> associateKeyframe(gpu::Context& context, const SurfelKernels& kernels, KeyframeMaps& maps,
                                   FusionScratch& scratch, const FusionParameters& parameters, const FusionStep& step);

/// Updates and removes what associateKeyframe() has just found, with the same maps, scratch and step.
Result<FusionCounts> fuseKeyframe(gpu::Context& context, const SurfelKernels& kernels, const KeyframeMaps& maps,
                                  const FusionScratch& scratch, const FusionParameters& parameters,
                                  const FusionStep& step);

/// Inserts what associateKeyframe() has counted, with the same maps, scratch and step. `targets`: where new surfels go,
/// in order, behind the rows in use; together with room for all.
Result<void> insertNew(gpu::Context& context, const SurfelKernels& kernels, const KeyframeMaps& maps,
                       const FusionScratch& scratch, const FusionStep& step, std::span<const ChunkRows> targets);

}  // namespace comap
