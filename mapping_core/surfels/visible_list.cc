#include "mapping_core/surfels/visible_list.h"

namespace comap {
namespace {

constexpr size_t kHeaderBytes = 16;

// A surfel moves by less than the slack of boxes (shaders/list_blocks.comp) in so many fusions: each is a share of at
// most 5 cm that shrinks with what it has seen.
constexpr uint32_t kFusionsPerBox = 8;

}  // namespace

Result<void> VisibleList::reserve(gpu::Context& context, size_t count) {
  if (count <= surfels) return {};
  surfels = 0;
  auto made = gpu::Buffer::create(context, kHeaderBytes + count * 8, "visible surfels");
  if (!made) return made.error();
  auto made_blocks =
      gpu::Buffer::create(context, kHeaderBytes + gpu::groupsFor(count, kBlockItems) * size_t{4}, "blocks in view");
  if (!made_blocks) return made_blocks.error();
  list = std::move(*made);
  blocks = std::move(*made_blocks);
  surfels = count;
  return {};
}

void VisibleList::record(gpu::Recorder& recorder, const SurfelKernels& kernels, const SurfelStreams& streams,
                         const ListVisiblePush& push, const SeenStep* seen) const {
  recorder.fill(list, 0, kHeaderBytes);
  recorder.fill(blocks, 0, kHeaderBytes);
  const uint32_t all = gpu::groupsFor(push.count, kBlockItems), held = streams.boxed / kBlockItems;
  if (streams.boxed < push.count) {
    recorder.dispatch(*kernels.bound_blocks, {&streams.places, &streams.boxes}, BoundBlocksPush{held, push.count},
                      all - held);
  }
  recorder.dispatch(*kernels.list_blocks, {&streams.boxes, &blocks},
                    ListBlocksPush{{push}, all, push.max_depth, push.margin}, gpu::groupsFor(all, kBlockItems));
  if (seen == nullptr || seen->filter.which == SeenBy::kAny) {
    recorder.dispatchIndirect(*kernels.list_visible, {&streams.places, &list, &blocks}, push, blocks);
    return;
  }
  const SeenFilter& filter = seen->filter;
  recorder.dispatchIndirect(
      *seen->kernels->list_seen, {&streams.places, &list, &blocks, &streams.times},
      ListSeenPush{{push}, filter.camera, filter.tick, filter.window, filter.which == SeenBy::kInactive ? 1u : 0u},
      blocks);
}

void noteBoxes(std::span<const ChunkRows> rows) {
  for (const ChunkRows& chunk : rows) {
    if (chunk.streams->boxed == 0) chunk.streams->fused = 0;
    chunk.streams->boxed = chunk.count;
  }
}

void noteFusion(std::span<const ChunkRows> rows) {
  for (const ChunkRows& chunk : rows) {
    if (++chunk.streams->fused >= kFusionsPerBox) chunk.streams->boxed = 0;
  }
}

}  // namespace comap
