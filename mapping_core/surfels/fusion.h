// One keyframe into the map: associate, update, clean up, insert. Removed surfels stay as marked gaps.
#pragma once

#include "mapping_core/surfels/keyframe_maps.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/visible_list.h"

namespace comap {

/// Buffers that only live through one fusion.
struct FusionScratch {
  VisibleList visible;
  gpu::Buffer blocks;    ///< u32 per block of a scan
  gpu::Buffer counters;  ///< updated, removed, inserted
  size_t surfels = 0;

  Result<void> reserve(gpu::Context& context, size_t count);
};

struct FusionCounts {
  uint32_t updated = 0, removed = 0, inserted = 0;
};

struct FusionStep {
  FramePush frame;
  uint32_t count = 0;  ///< rows of the streams in use
  uint32_t owner = 0;
  uint32_t contributor = 0;
};

/// Most surfels one keyframe can add.
size_t mostInsertions(const CameraModel& camera);

/// `maps` holds the uploaded images; `streams` has room for count + mostInsertions().
Result<FusionCounts> fuseKeyframe(gpu::Context& context, const SurfelKernels& kernels, SurfelStreams& streams,
                                  KeyframeMaps& maps, FusionScratch& scratch, const FusionParameters& parameters,
                                  const FusionStep& step);

}  // namespace comap
