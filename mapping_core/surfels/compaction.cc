#include "mapping_core/surfels/compaction.h"

#include <algorithm>

namespace comap {

Result<uint32_t> compactStreams(gpu::Context& context, const SurfelKernels& kernels, const SurfelStreams& from,
                                SurfelStreams& to, FusionScratch& scratch, uint32_t count) {
  if (auto done = scratch.reserve(context, {}, std::max(count, 1u)); !done) return done.error();
  auto recorder = gpu::Recorder::begin(context);
  if (!recorder) return recorder.error();
  const uint32_t blocks = gpu::groupsFor(count, kBlockItems);
  recorder->fill(scratch.counters, 0, sizeof(uint32_t));
  recorder->dispatch(*kernels.count_alive, {&from.places, &scratch.blocks}, CountAlivePush{count}, blocks);
  recorder->dispatch(*kernels.scan_blocks, {&scratch.blocks, &scratch.counters}, ScanBlocksPush{blocks, 0}, 1);
  const struct {
    const gpu::Buffer *from, *to;
    uint32_t pairs;
  } table[] = {{&from.places, &to.places, 2},
               {&from.shapes, &to.shapes, 2},
               {&from.looks, &to.looks, 2},
               {&from.records, &to.records, 1}};
  if (from.timed()) {
    recorder->dispatch(*kernels.compact, {&from.places, &scratch.blocks, &from.times, &to.times}, CompactPush{count, 2},
                       blocks);
  }
  for (const auto& entry : table) {
    recorder->dispatch(*kernels.compact, {&from.places, &scratch.blocks, entry.from, entry.to},
                       CompactPush{count, entry.pairs}, blocks);
  }
  if (auto done = recorder->submit(); !done) return done.error();
  uint32_t left = 0;
  if (auto done = scratch.counters.read(&left, sizeof(left)); !done) return done.error();
  return left;
}

}  // namespace comap
