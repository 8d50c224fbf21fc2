#include "mapping_core/surfels/timed_kernels.h"

#include "mapping_core/surfels/push_constants.h"

// SPIR-V as words, made from shaders/ by the build.
#include "shaders/expire.h"
#include "shaders/list_seen.h"
#include "shaders/resolve_owner.h"
#include "shaders/stamp_fused.h"
#include "shaders/stamp_new.h"

namespace comap {

Result<TimedKernels> TimedKernels::create(gpu::Context& context) {
  TimedKernels kernels;
  const struct {
    const gpu::Kernel** slot;
    gpu::KernelSource source;
  } table[] = {
      {&kernels.list_seen, {"list_seen", kListSeenSpirv, 4, sizeof(ListSeenPush)}},
      {&kernels.stamp_fused, {"stamp_fused", kStampFusedSpirv, 3, sizeof(StampFusedPush)}},
      {&kernels.stamp_new, {"stamp_new", kStampNewSpirv, 2, sizeof(StampNewPush)}},
      {&kernels.expire, {"expire", kExpireSpirv, 3, sizeof(ExpirePush)}},
      {&kernels.resolve_owner, {"resolve_owner", kResolveOwnerSpirv, 6, sizeof(SplatPush)}},
  };
  for (const auto& entry : table) {
    auto kernel = gpu::findKernel(context, entry.source);
    if (!kernel) return kernel.error();
    *entry.slot = *kernel;
  }
  return kernels;
}

}  // namespace comap
