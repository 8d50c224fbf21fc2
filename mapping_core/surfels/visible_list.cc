#include "mapping_core/surfels/visible_list.h"

namespace comap {
namespace {

constexpr size_t kHeaderBytes = 16;

}  // namespace

Result<void> VisibleList::reserve(gpu::Context& context, size_t count) {
  if (count <= surfels) return {};
  auto made = gpu::Buffer::create(context, kHeaderBytes + count * 8, "visible surfels");
  if (!made) return made.error();
  list = std::move(*made);
  surfels = count;
  return {};
}

void VisibleList::record(gpu::Recorder& recorder, const SurfelKernels& kernels, const SurfelStreams& streams,
                         const ListVisiblePush& push, const SeenStep* seen) const {
  recorder.fill(list, 0, kHeaderBytes);
  const uint32_t groups = gpu::groupsFor(push.count, kBlockItems);
  if (seen == nullptr || seen->filter.which == SeenBy::kAny) {
    recorder.dispatch(*kernels.list_visible, {&streams.places, &list}, push, groups);
    return;
  }
  const SeenFilter& filter = seen->filter;
  recorder.dispatch(
      *seen->kernels->list_seen, {&streams.places, &list, &streams.times},
      ListSeenPush{{push}, filter.camera, filter.tick, filter.window, filter.which == SeenBy::kInactive ? 1u : 0u},
      groups);
}

}  // namespace comap
