// Compiled kernels on disk. For this folder's sources only.
#pragma once

#include "mapping_core/gpu/context.h"

namespace comap::gpu {

/// Makes the context's cache, from what an earlier process left for the same device and driver, if it did.
Result<void> openPipelineCache(Context& context);

/// Leaves the cache for the next process if there is something new in it. Never fails: without it, kernels are
/// compiled.
void savePipelineCache(const Context& context);

}  // namespace comap::gpu
