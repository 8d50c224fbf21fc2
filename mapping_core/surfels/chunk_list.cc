#include "mapping_core/surfels/chunk_list.h"

#include <algorithm>
#include <bit>
#include <string>

#include "mapping_core/surfels/view_bounds.h"
#include "protocol/types/keyframe.h"

namespace comap {
namespace {

// Gaps are closed when they are more than one in this many: closing costs a copy of the chunk.
constexpr uint32_t kGapShare = 8;

Result<void> checkInput(const FusionInput& input) {
  const auto& [camera, colour, depth, depth_hits, T_map_cam, owner, contributor] = input;
  if (auto done = checkCamera(camera, T_map_cam); !done) return done;
  const auto fits = [width = camera.width, height = camera.height](const auto& image) {
    return image.width() == width && image.height() == height;
  };
  if (!fits(colour) || !fits(depth)) {
    return Error{ErrorCode::kWrongUse, "keyframe has colour of " + std::to_string(colour.width()) + " x " +
                                           std::to_string(colour.height()) + " and depth of " +
                                           std::to_string(depth.width()) + " x " + std::to_string(depth.height()) +
                                           " pixels, expected the camera's " + std::to_string(camera.width) + " x " +
                                           std::to_string(camera.height)};
  }
  const auto blocks = [](int pixels) { return (pixels + kHitBlock - 1) / kHitBlock; };
  if (!depth_hits.empty() &&
      (depth_hits.width() != blocks(camera.width) || depth_hits.height() != blocks(camera.height))) {
    return Error{ErrorCode::kWrongUse, "keyframe has depth hits of " + std::to_string(depth_hits.width()) + " x " +
                                           std::to_string(depth_hits.height()) + " blocks, expected " +
                                           std::to_string(blocks(camera.width)) + " x " +
                                           std::to_string(blocks(camera.height))};
  }
  return {};
}

}  // namespace

std::vector<ChunkRows> rowsOf(const std::vector<SurfelChunk*>& chunks) {
  std::vector<ChunkRows> rows;
  for (SurfelChunk* chunk : chunks) rows.push_back({&chunk->streams, chunk->rows});
  return rows;
}

size_t ChunkList::size() const {
  size_t count = 0;
  for (const auto& chunk : chunks) count += chunk->rows - chunk->gaps;
  return count;
}

size_t ChunkList::firstCapacity() const {
  return std::bit_ceil(std::clamp<size_t>(parameters.initial_capacity, kBlockItems, kChunkSurfels));
}

Result<std::vector<SurfelChunk*>> ChunkList::chunksInView(const FramePush& frame, float farthest, float margin_px) {
  std::vector<SurfelChunk*> seen;
  for (const auto& chunk : chunks) {
    if (chunk->rows == 0 || !chunk->bounds.mayBeInView(frame, farthest, margin_px)) continue;
    if (auto done = pool->need(*chunk); !done) return done.error();
    seen.push_back(chunk.get());
  }
  return seen;
}

Result<std::vector<SurfelChunk*>> ChunkList::makeRoom(size_t count) {
  if (chunks.empty()) {
    auto made = pool->makeChunk(firstCapacity());
    if (!made) return made.error();
    chunks.push_back(std::move(*made));
  }
  std::vector<SurfelChunk*> targets;
  size_t room = 0;
  if (SurfelChunk& last = *chunks.back(); last.rows < kChunkSurfels) {
    const size_t wanted = std::min(last.rows + count, kChunkSurfels);
    if (auto done = pool->grow(last, std::max(last.capacity, std::bit_ceil(wanted))); !done) return done.error();
    targets.push_back(&last);
    room = last.capacity - last.rows;
  }
  for (; room < count; room += kChunkSurfels) {
    auto made = pool->makeChunk(kChunkSurfels);
    if (!made) return made.error();
    chunks.push_back(std::move(*made));
    targets.push_back(chunks.back().get());
  }
  return targets;
}

void ChunkList::dropEmpty() {
  std::erase_if(chunks, [](const auto& chunk) { return chunk->rows == 0; });
}

// Closes gaps where they are many, and lays neighbours together that then fit into one chunk.
Result<void> ChunkList::tidy() {
  for (const auto& chunk : chunks) {
    if (chunk->away || chunk->gaps <= chunk->rows / kGapShare) continue;
    auto done = pool->compact(*chunk);
    if (!done && done.error().code == ErrorCode::kOutOfMemory) continue;  // with a later keyframe: it takes a spare
    if (!done) return done;
  }
  for (size_t i = 1; i < chunks.size(); ++i) {
    SurfelChunk &into = *chunks[i - 1], &from = *chunks[i];
    if (into.away || from.away || into.rows + from.rows > into.capacity) continue;
    if (auto done = copyRows(pool->context, from.streams, from.rows, into.streams, into.rows); !done) return done;
    into.bounds.extend(from.bounds);
    into.owners.insert(from.owners.begin(), from.owners.end());
    into.rows += from.rows;
    into.gaps += from.gaps;
    from.rows = 0;
    break;
  }
  dropEmpty();
  return {};
}

Result<FusionReport> ChunkList::fuse(const FusionInput& input, const SeenStep* times) {
  if (auto checked = checkInput(input); !checked) return checked.error();
  const CameraModel& camera = input.camera;
  pool->beginStep();
  const FramePush frame = framePush(camera, input.T_map_cam, parameters);
  const auto seen = chunksInView(frame, parameters.depth_max_m + 1, 1);
  if (!seen) return seen.error();
  if (auto done = pool->maps.reserve(pool->context, input.depth.size()); !done) return done.error();
  if (auto done = pool->maps.upload(input.colour, input.depth, input.depth_hits, parameters); !done)
    return done.error();

  const auto seen_rows = rowsOf(*seen);
  const FusionStep step{frame, seen_rows, input.owner, input.contributor, times};
  const auto inserted = associateKeyframe(pool->context, pool->kernels, pool->maps, pool->scratch, parameters, step);
  if (!inserted) return inserted.error();
  // Before anything is changed: a keyframe is in the map whole, or not at all.
  auto targets = roomFor(*inserted, *seen);
  if (!targets) return targets.error();
  const auto counts = fuseKeyframe(pool->context, pool->kernels, pool->maps, pool->scratch, parameters, step);
  if (!counts) return counts.error();
  FusionReport report{counts->updated, *inserted, 0, 0};
  for (size_t i = 0; i < seen->size(); ++i) {
    (*seen)[i]->gaps += counts->removed[i];
    report.removed += counts->removed[i];
  }
  if (*inserted > 0) {
    if (auto done = insert(step, *inserted, *targets); !done) return done.error();
  }
  if (auto done = tidy(); !done) return done.error();
  report.total = static_cast<uint32_t>(size());
  return report;
}

// Each step has all the memory: what is in view may leave to make room for what is new, and comes back. What has fitted
// once fits again.
Result<std::vector<SurfelChunk*>> ChunkList::roomFor(uint32_t count, const std::vector<SurfelChunk*>& seen) {
  std::vector<SurfelChunk*> targets;
  if (count > 0) {
    pool->beginStep();
    auto room = makeRoom(count);
    if (!room) return room;
    targets = std::move(*room);
  }
  if (auto back = needAll(seen); !back) return back.error();
  return targets;
}

Result<void> ChunkList::needAll(const std::vector<SurfelChunk*>& wanted) {
  pool->beginStep();
  for (SurfelChunk* chunk : wanted)
    if (auto done = pool->need(*chunk); !done) return done;
  return {};
}

Result<void> ChunkList::insert(const FusionStep& step, uint32_t count, const std::vector<SurfelChunk*>& targets) {
  if (auto here = needAll(targets); !here) return here;
  if (auto done = insertNew(pool->context, pool->kernels, pool->maps, pool->scratch, step, rowsOf(targets)); !done) {
    return done;
  }
  const Eigen::AlignedBox3f view = viewBounds(step.frame, parameters.depth_max_m);
  uint32_t left = count;
  for (SurfelChunk* target : targets) {
    const uint32_t taken = std::min(left, static_cast<uint32_t>(target->capacity) - target->rows);
    if (taken > 0) {
      target->bounds.extend(view);
      target->owners.insert(step.owner);
    }
    target->rows += taken;
    left -= taken;
  }
  return {};
}

// Neighbours are read at once: on a device that the host cannot see each reading is a wait.
Result<void> ChunkList::readChanged(const SurfelChunk& chunk, uint64_t moment,
                                    std::vector<SurfelBlock>& changed) const {
  const size_t blocks = chunk.moments.blocks();
  for (size_t begin = 0; begin < blocks; ++begin) {
    if (chunk.moments.of(begin) <= moment) continue;
    size_t end = begin + 1;
    while (end < blocks && chunk.moments.of(end) > moment) ++end;
    const size_t first = begin * kBlockItems, count = std::min<size_t>(end * kBlockItems, chunk.rows) - first;
    const auto rows = pool->rowsOf(chunk, first, count);
    if (!rows) return rows.error();
    for (size_t block = begin; block < end; ++block) {
      const size_t at = (block - begin) * kBlockItems;
      changed.push_back(
          {chunk.number * kChunkSurfels + block, unpack(*rows, at, std::min<size_t>(kBlockItems, count - at))});
    }
    begin = end;
  }
  return {};
}

Result<PredictedView> ChunkList::predict(const CameraModel& camera, const Pose& T_map_cam,
                                         const PredictionOptions& options, const SeenStep* times) {
  if (auto done = checkCamera(camera, T_map_cam); !done) return done.error();
  pool->beginStep();
  const FramePush frame = framePush(camera, T_map_cam, parameters);
  const auto seen = chunksInView(frame, options.max_depth_m, kFootprintMargin_px);
  if (!seen) return seen.error();
  return predictView(pool->context, pool->kernels, rowsOf(*seen), pool->prediction, frame, camera, options, times);
}

}  // namespace comap
