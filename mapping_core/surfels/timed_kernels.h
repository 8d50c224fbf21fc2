// The kernels of maps whose surfels know when each camera last saw them, one per file in shaders/.
#pragma once

#include "mapping_core/gpu/kernel.h"

namespace comap {

struct TimedKernels {
  const gpu::Kernel* list_seen = nullptr;
  const gpu::Kernel* stamp_fused = nullptr;
  const gpu::Kernel* stamp_new = nullptr;
  const gpu::Kernel* expire = nullptr;
  const gpu::Kernel* resolve_owner = nullptr;

  /// Compiled once per device, however many maps it holds.
  static Result<TimedKernels> create(gpu::Context& context);
};

}  // namespace comap
