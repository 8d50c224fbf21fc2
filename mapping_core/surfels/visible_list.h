// The surfels a camera may see, so that the costlier kernels run for those only.
#pragma once

#include "mapping_core/gpu/recorder.h"
#include "mapping_core/surfels/push_constants.h"
#include "mapping_core/surfels/seen_times.h"
#include "mapping_core/surfels/surfel_kernels.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/timed_kernels.h"

namespace comap {

/// Which surfels of a timed map are worked on.
struct SeenStep {
  SeenFilter filter;
  const TimedKernels* kernels = nullptr;
};

struct VisibleList {
  gpu::Buffer list;  ///< see shaders/common/visible.glsl; its first word is a number of workgroups
  size_t surfels = 0;

  Result<void> reserve(gpu::Context& context, size_t count);
  /// `seen`: only those; all if null.
  void record(gpu::Recorder& recorder, const SurfelKernels& kernels, const SurfelStreams& streams,
              const ListVisiblePush& push, const SeenStep* seen) const;
};

}  // namespace comap
