#include "mapping_core/surfels/surfel_kernels.h"

#include "mapping_core/surfels/push_constants.h"

// SPIR-V as words, made from shaders/ by the build.
#include "shaders/associate.h"
#include "shaders/blend.h"
#include "shaders/bound_blocks.h"
#include "shaders/carry_ranks.h"
#include "shaders/clean_up.h"
#include "shaders/compact.h"
#include "shaders/count_alive.h"
#include "shaders/count_new.h"
#include "shaders/filter_depth.h"
#include "shaders/fuse.h"
#include "shaders/insert.h"
#include "shaders/list_blocks.h"
#include "shaders/list_visible.h"
#include "shaders/measure.h"
#include "shaders/move_owners.h"
#include "shaders/resolve.h"
#include "shaders/scan_blocks.h"
#include "shaders/splat_depth.h"
#include "shaders/splat_index.h"

namespace comap {
namespace {

template <class Push>
constexpr gpu::KernelSource source(const char* name, std::span<const uint32_t> code, uint32_t bindings) {
  return {name, code, bindings, sizeof(Push)};
}

}  // namespace

Result<SurfelKernels> SurfelKernels::create(gpu::Context& context) {
  SurfelKernels kernels;
  const struct {
    const gpu::Kernel** slot;
    gpu::KernelSource source;
  } table[] = {
      {&kernels.filter_depth, source<FilterDepthPush>("filter_depth", kFilterDepthSpirv, 2)},
      {&kernels.measure, source<FramePush>("measure", kMeasureSpirv, 2)},
      {&kernels.bound_blocks, source<BoundBlocksPush>("bound_blocks", kBoundBlocksSpirv, 2)},
      {&kernels.list_blocks, source<ListBlocksPush>("list_blocks", kListBlocksSpirv, 2)},
      {&kernels.list_visible, source<ListVisiblePush>("list_visible", kListVisibleSpirv, 3)},
      {&kernels.associate, source<AssociatePush>("associate", kAssociateSpirv, 7)},
      {&kernels.fuse, source<FusePush>("fuse", kFuseSpirv, 9)},
      {&kernels.clean_up, source<CleanUpPush>("clean_up", kCleanUpSpirv, 8)},
      {&kernels.count_new, source<CountNewPush>("count_new", kCountNewSpirv, 3)},
      {&kernels.insert, source<InsertPush>("insert", kInsertSpirv, 8)},
      {&kernels.scan_blocks, source<ScanBlocksPush>("scan_blocks", kScanBlocksSpirv, 2)},
      {&kernels.count_alive, source<CountAlivePush>("count_alive", kCountAliveSpirv, 2)},
      {&kernels.compact, source<CompactPush>("compact", kCompactSpirv, 4)},
      {&kernels.splat_depth, source<SplatPush>("splat_depth", kSplatDepthSpirv, 4)},
      {&kernels.splat_index, source<SplatPush>("splat_index", kSplatIndexSpirv, 5)},
      {&kernels.resolve, source<SplatPush>("resolve", kResolveSpirv, 6)},
      {&kernels.carry_ranks, source<CarryRanksPush>("carry_ranks", kCarryRanksSpirv, 1)},
      {&kernels.blend, source<SplatPush>("blend", kBlendSpirv, 7)},
      {&kernels.move_owners, source<MoveOwnersPush>("move_owners", kMoveOwnersSpirv, 4)},
  };
  for (const auto& entry : table) {
    auto kernel = gpu::findKernel(context, entry.source);
    if (!kernel) return kernel.error();
    *entry.slot = *kernel;
  }
  return kernels;
}

}  // namespace comap
