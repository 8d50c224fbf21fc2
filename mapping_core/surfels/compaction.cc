#include "mapping_core/surfels/compaction.h"

namespace comap {

Result<uint32_t> compactStreams(gpu::Context& context, const SurfelKernels& kernels, SurfelStreams& streams,
                                FusionScratch& scratch, uint32_t count) {
  if (auto done = scratch.reserve(context, count); !done) return done.error();
  auto target = SurfelStreams::create(context, streams.capacity);
  if (!target) return target.error();
  auto recorder = gpu::Recorder::begin(context);
  if (!recorder) return recorder.error();
  const uint32_t blocks = gpu::groupsFor(count, kBlockItems);
  recorder->fill(scratch.counters, 0, sizeof(FusionCounts));
  recorder->dispatch(*kernels.count_alive, {&streams.places, &scratch.blocks}, CountAlivePush{count}, blocks);
  recorder->dispatch(*kernels.scan_blocks, {&scratch.blocks, &scratch.counters}, ScanBlocksPush{blocks, 0}, 1);
  const struct {
    const gpu::Buffer *from, *to;
    uint32_t pairs;
  } table[] = {{&streams.places, &target->places, 2},
               {&streams.shapes, &target->shapes, 2},
               {&streams.looks, &target->looks, 2},
               {&streams.records, &target->records, 1}};
  for (const auto& entry : table) {
    recorder->dispatch(*kernels.compact, {&streams.places, &scratch.blocks, entry.from, entry.to},
                       CompactPush{count, entry.pairs}, blocks);
  }
  if (auto done = recorder->submit(); !done) return done.error();
  uint32_t left = 0;
  if (auto done = scratch.counters.read(&left, sizeof(left)); !done) return done.error();
  streams = std::move(*target);
  return left;
}

}  // namespace comap
