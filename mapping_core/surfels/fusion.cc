#include "mapping_core/surfels/fusion.h"

#include <algorithm>
#include <string>

namespace comap {

Result<void> FusionScratch::reserve(gpu::Context& context, std::span<const ChunkRows> rows, size_t items) {
  if (visible.size() < rows.size()) visible.resize(rows.size());
  for (size_t i = 0; i < rows.size(); ++i) {
    if (auto done = visible[i].reserve(context, rows[i].streams->capacity); !done) return done;
  }
  if (items > surfels) {
    surfels = 0;
    auto made = gpu::Buffer::create(context, gpu::groupsFor(items, kBlockItems) * sizeof(uint32_t), "scan blocks");
    if (!made) return made.error();
    blocks = std::move(*made);
    surfels = items;
  }
  if (rows.size() > chunks || counters.bytes() == 0) {
    chunks = 0;
    auto made = gpu::Buffer::create(context, (2 * rows.size() + 1) * sizeof(uint32_t), "counters");
    if (!made) return made.error();
    counters = std::move(*made);
    chunks = rows.size();
  }
  return {};
}

namespace {

// Pixels that may start a surfel.
uint32_t candidatesOf(const FramePush& frame) { return ((frame.width + 1) / 2) * ((frame.height + 1) / 2); }

void forEachChunk(const FusionStep& step, const FusionScratch& scratch, const auto& record) {
  uint32_t base = 0;
  for (uint32_t chunk = 0; chunk < step.seen.size(); ++chunk) {
    record(*step.seen[chunk].streams, scratch.visible[chunk], base, chunk);
    base += step.seen[chunk].count;
  }
}

// What a timed map does besides: the camera's time for what it updated, and an end to what nobody confirms.
void recordStamps(gpu::Recorder& recorder, const KeyframeMaps& maps, const FusionScratch& scratch,
                  const FusionParameters& parameters, const FusionStep& step) {
  const SeenFilter& now = step.times->filter;
  uint32_t base = 0, chunk = 0;
  for (const ChunkRows& rows : step.seen) {
    const SurfelStreams& streams = *rows.streams;
    const gpu::Buffer& visible = scratch.visible[chunk].list;
    recorder.dispatchIndirect(*step.times->kernels->stamp_fused, {&visible, &maps.winners, &streams.times},
                              StampFusedPush{base, now.camera, now.tick}, visible);
    recorder.dispatch(
        *step.times->kernels->expire, {&streams.places, &streams.times, &scratch.counters},
        ExpirePush{rows.count, chunk, now.tick, parameters.unstable_timeout, parameters.stable_confidence},
        gpu::groupsFor(rows.count, kBlockItems));
    base += rows.count;
    ++chunk;
  }
}

}  // namespace

Result<uint32_t> associateKeyframe(gpu::Context& context, const SurfelKernels& kernels, KeyframeMaps& maps,
                                   FusionScratch& scratch, const FusionParameters& parameters, const FusionStep& step) {
  const FramePush& frame = step.frame;
  const size_t pixels = size_t{frame.width} * frame.height;
  const uint32_t candidates = candidatesOf(frame);
  const uint32_t blocks = gpu::groupsFor(candidates, kBlockItems);
  size_t all = 0;
  for (const ChunkRows& rows : step.seen) all += rows.count;
  if (all > kMostSurfels) {
    return Error{ErrorCode::kOutOfMemory, "the keyframe looks at chunks of " + std::to_string(all) +
                                              " surfels, at most " + std::to_string(kMostSurfels) +
                                              " can be fused with at once; a smaller depth_max_m has fewer in view"};
  }
  if (auto done = scratch.reserve(context, step.seen, candidates); !done) return done.error();
  const auto chunks = static_cast<uint32_t>(step.seen.size());
  auto recorder =
      gpu::Recorder::begin(context, static_cast<uint32_t>(8 + (1 + VisibleList::kDispatches) * step.seen.size()));
  if (!recorder) return recorder.error();

  maps.recordMeasure(*recorder, kernels, frame);
  recorder->fill(maps.winners, 0xffffffffu, pixels * 4);
  recorder->fill(maps.covered, 0, pixels * 4);
  recorder->fill(scratch.counters, 0, (2 * chunks + 1) * sizeof(uint32_t));
  forEachChunk(step, scratch, [&](const SurfelStreams& streams, const VisibleList& visible, uint32_t, uint32_t chunk) {
    visible.record(*recorder, kernels, streams, {{frame}, step.seen[chunk].count, 0, parameters.depth_max_m + 1, 1},
                   step.times);
  });
  forEachChunk(step, scratch, [&](const SurfelStreams& streams, const VisibleList& visible, uint32_t base, uint32_t) {
    recorder->dispatchIndirect(
        *kernels.associate,
        {&streams.places, &streams.shapes, &maps.measurements, &maps.raw, &visible.list, &maps.winners, &maps.covered},
        AssociatePush{{frame}, parameters.depth_min_m, parameters.depth_max_m, parameters.stable_confidence, base},
        visible.list);
  });
  recorder->dispatch(*kernels.count_new, {&maps.measurements, &maps.covered, &scratch.blocks},
                     CountNewPush{{frame}, candidates}, blocks);
  recorder->dispatch(*kernels.scan_blocks, {&scratch.blocks, &scratch.counters}, ScanBlocksPush{blocks, 2 * chunks}, 1);
  if (auto done = recorder->submit(); !done) return done.error();
  noteBoxes(step.seen);
  const auto read = scratch.counters.read<uint32_t>(2 * chunks + 1);
  if (!read) return read.error();
  return read->back();
}

Result<FusionCounts> fuseKeyframe(gpu::Context& context, const SurfelKernels& kernels, const KeyframeMaps& maps,
                                  const FusionScratch& scratch, const FusionParameters& parameters,
                                  const FusionStep& step) {
  const FramePush& frame = step.frame;
  const auto chunks = static_cast<uint32_t>(step.seen.size());
  auto recorder = gpu::Recorder::begin(context, 1 + 4 * chunks);
  if (!recorder) return recorder.error();
  forEachChunk(step, scratch, [&](const SurfelStreams& streams, const VisibleList& visible, uint32_t base, uint32_t) {
    recorder->dispatchIndirect(*kernels.fuse,
                               {&streams.places, &streams.shapes, &streams.looks, &streams.records, &maps.measurements,
                                &maps.colours, &visible.list, &maps.winners, &streams.touched},
                               FusePush{{frame}, parameters.averaging_limit, step.contributor, base}, visible.list);
  });
  forEachChunk(
      step, scratch, [&](const SurfelStreams& streams, const VisibleList& visible, uint32_t base, uint32_t chunk) {
        recorder->dispatchIndirect(
            *kernels.clean_up,
            {&streams.places, &streams.shapes, &streams.looks, &streams.records, &visible.list, &maps.winners,
             &scratch.counters, &streams.touched},
            CleanUpPush{{frame}, parameters.stable_confidence, parameters.unstable_timeout, base, chunk}, visible.list);
      });
  if (step.times) recordStamps(*recorder, maps, scratch, parameters, step);
  if (auto done = recorder->submit(); !done) return done.error();
  noteFusion(step.seen);

  const auto read = scratch.counters.read<uint32_t>(2 * chunks + 1);
  if (!read) return read.error();
  FusionCounts counts;
  for (uint32_t chunk = 0; chunk < chunks; ++chunk) {
    counts.updated += (*read)[2 * chunk];
    counts.removed.push_back((*read)[2 * chunk + 1]);
  }
  return counts;
}

Result<void> insertNew(gpu::Context& context, const SurfelKernels& kernels, const KeyframeMaps& maps,
                       const FusionScratch& scratch, const FusionStep& step, std::span<const ChunkRows> targets) {
  const FramePush& frame = step.frame;
  const uint32_t candidates = candidatesOf(frame), blocks = gpu::groupsFor(candidates, kBlockItems);
  auto recorder = gpu::Recorder::begin(context, static_cast<uint32_t>(2 * targets.size() + 1));
  if (!recorder) return recorder.error();
  uint32_t start = 0;  // of the new surfels, counted from the target's first row
  for (const ChunkRows& target : targets) {
    start += target.count;
    const auto capacity = static_cast<uint32_t>(target.streams->capacity);
    recorder->dispatch(*kernels.insert,
                       {&maps.measurements, &maps.covered, &scratch.blocks, &maps.colours, &target.streams->places,
                        &target.streams->shapes, &target.streams->looks, &target.streams->records},
                       InsertPush{{frame}, candidates, start, capacity, step.owner, step.contributor}, blocks);
    if (step.times) {
      const SeenFilter& now = step.times->filter;
      recorder->dispatch(
          *step.times->kernels->stamp_new, {&scratch.counters, &target.streams->times},
          StampNewPush{candidates, 2 * static_cast<uint32_t>(step.seen.size()), start, capacity, now.camera, now.tick},
          blocks);
    }
    start -= capacity;
  }
  return recorder->submit();
}

}  // namespace comap
