// The map's kernels, one per file in shaders/.
#pragma once

#include "mapping_core/gpu/kernel.h"

namespace comap {

struct SurfelKernels {
  const gpu::Kernel* filter_depth = nullptr;
  const gpu::Kernel* measure = nullptr;
  const gpu::Kernel* bound_blocks = nullptr;
  const gpu::Kernel* list_blocks = nullptr;
  const gpu::Kernel* list_visible = nullptr;
  const gpu::Kernel* associate = nullptr;
  const gpu::Kernel* fuse = nullptr;
  const gpu::Kernel* clean_up = nullptr;
  const gpu::Kernel* count_new = nullptr;
  const gpu::Kernel* insert = nullptr;
  const gpu::Kernel* scan_blocks = nullptr;
  const gpu::Kernel* count_alive = nullptr;
  const gpu::Kernel* compact = nullptr;
  const gpu::Kernel* splat_depth = nullptr;
  const gpu::Kernel* splat_index = nullptr;
  const gpu::Kernel* resolve = nullptr;
  const gpu::Kernel* carry_ranks = nullptr;
  const gpu::Kernel* blend = nullptr;
  const gpu::Kernel* move_owners = nullptr;

  /// Compiled once per device, however many maps it holds.
  static Result<SurfelKernels> create(gpu::Context& context);
};

/// Surfels, pixels or flags per workgroup, of all kernels.
inline constexpr uint32_t kBlockItems = 1024;

}  // namespace comap
