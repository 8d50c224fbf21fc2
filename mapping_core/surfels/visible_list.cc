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
                         const ListVisiblePush& push) const {
  recorder.fill(list, 0, kHeaderBytes);
  recorder.dispatch(*kernels.list_visible, {&streams.places, &list}, push, gpu::groupsFor(push.count, kBlockItems));
}

}  // namespace comap
