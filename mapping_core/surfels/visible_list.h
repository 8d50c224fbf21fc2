// The surfels a camera may see, so that the costlier kernels run for those only.
#pragma once

#include <span>

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
  gpu::Buffer list;    ///< see shaders/common/visible.glsl; its first word is a number of workgroups
  gpu::Buffer blocks;  ///< of rows that may be in view, see shaders/list_blocks.comp
  size_t surfels = 0;

  Result<void> reserve(gpu::Context& context, size_t count);
  /// Dispatches that record() adds at most.
  static constexpr uint32_t kDispatches = 3;
  /// Makes boxes that are missing. `seen`: only those; all if null. Once it has run: noteBoxes().
  void record(gpu::Recorder& recorder, const SurfelKernels& kernels, const SurfelStreams& streams,
              const ListVisiblePush& push, const SeenStep* seen) const;
};

/// Rows of a map that are worked on, one chunk of it.
struct ChunkRows {
  SurfelStreams* streams = nullptr;
  uint32_t count = 0;  ///< rows in use
};

/// The boxes of these rows have been made.
void noteBoxes(std::span<const ChunkRows> rows);
/// Surfels of these rows have been moved by a fusion: now and then their boxes are to be made anew.
void noteFusion(std::span<const ChunkRows> rows);

}  // namespace comap
