#include "mapping_core/surfels/fusion.h"

namespace comap {
namespace {

constexpr uint32_t kInsertedSlot = 2;

}  // namespace

size_t mostInsertions(const CameraModel& camera) {
  return static_cast<size_t>((camera.width + 1) / 2) * static_cast<size_t>((camera.height + 1) / 2);
}

Result<void> FusionScratch::reserve(gpu::Context& context, size_t count) {
  if (count <= surfels) return {};
  surfels = 0;
  if (auto done = visible.reserve(context, count); !done) return done;
  auto made_blocks = gpu::Buffer::create(context, gpu::groupsFor(count, kBlockItems) * sizeof(uint32_t), "scan blocks");
  if (!made_blocks) return made_blocks.error();
  auto made_counters = gpu::Buffer::create(context, sizeof(FusionCounts), "counters");
  if (!made_counters) return made_counters.error();
  blocks = std::move(*made_blocks);
  counters = std::move(*made_counters);
  surfels = count;
  return {};
}

Result<FusionCounts> fuseKeyframe(gpu::Context& context, const SurfelKernels& kernels, SurfelStreams& streams,
                                  KeyframeMaps& maps, FusionScratch& scratch, const FusionParameters& parameters,
                                  const FusionStep& step) {
  const FramePush& frame = step.frame;
  const size_t pixels = size_t{frame.width} * frame.height;
  const uint32_t candidates = ((frame.width + 1) / 2) * ((frame.height + 1) / 2);
  const uint32_t blocks = gpu::groupsFor(candidates, kBlockItems);
  auto recorder = gpu::Recorder::begin(context);
  if (!recorder) return recorder.error();

  maps.recordMeasure(*recorder, kernels, frame);
  recorder->fill(maps.winners, 0xffffffffu, pixels * 4);
  recorder->fill(maps.covered, 0, pixels * 4);
  recorder->fill(scratch.counters, 0, sizeof(FusionCounts));
  scratch.visible.record(*recorder, kernels, streams, {{frame}, step.count, 0, parameters.depth_max_m + 1, 1});
  const gpu::Buffer& visible = scratch.visible.list;
  recorder->dispatchIndirect(
      *kernels.associate,
      {&streams.places, &streams.shapes, &maps.measurements, &maps.raw, &visible, &maps.winners, &maps.covered},
      AssociatePush{{frame}, parameters.depth_min_m, parameters.depth_max_m, parameters.stable_confidence}, visible);
  recorder->dispatchIndirect(*kernels.fuse,
                             {&streams.places, &streams.shapes, &streams.looks, &streams.records, &maps.measurements,
                              &maps.colours, &visible, &maps.winners},
                             FusePush{{frame}, parameters.averaging_limit, step.contributor}, visible);
  recorder->dispatchIndirect(
      *kernels.clean_up,
      {&streams.places, &streams.shapes, &streams.looks, &streams.records, &visible, &maps.winners, &scratch.counters},
      CleanUpPush{{frame}, parameters.stable_confidence, parameters.unstable_timeout}, visible);
  recorder->dispatch(*kernels.count_new, {&maps.measurements, &maps.covered, &scratch.blocks},
                     CountNewPush{{frame}, candidates}, blocks);
  recorder->dispatch(*kernels.scan_blocks, {&scratch.blocks, &scratch.counters}, ScanBlocksPush{blocks, kInsertedSlot},
                     1);
  recorder->dispatch(*kernels.insert,
                     {&maps.measurements, &maps.covered, &scratch.blocks, &maps.colours, &streams.places,
                      &streams.shapes, &streams.looks, &streams.records},
                     InsertPush{{frame}, candidates, step.count, step.owner, step.contributor}, blocks);
  if (auto done = recorder->submit(); !done) return done.error();

  FusionCounts counts;
  if (auto done = scratch.counters.read(&counts, sizeof(counts)); !done) return done.error();
  return counts;
}

}  // namespace comap
