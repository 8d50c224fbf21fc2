// Closes the gaps that removed surfels left, keeping the order.
#pragma once

#include "mapping_core/surfels/fusion.h"

namespace comap {

/// Returns how many of the first `count` rows are left; `to`, as large as `from`, then holds them without gaps.
Result<uint32_t> compactStreams(gpu::Context& context, const SurfelKernels& kernels, const SurfelStreams& from,
                                SurfelStreams& to, FusionScratch& scratch, uint32_t count);

}  // namespace comap
