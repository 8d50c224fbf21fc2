#include "mapping_core/surfels/surfel_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "mapping_core/surfels/surfel_pool.h"
#include "mapping_core/surfels/view_bounds.h"
#include "protocol/types/keyframe.h"

namespace comap {
namespace {

// Gaps are closed when they are more than one in this many: closing costs a copy of the chunk.
constexpr uint32_t kGapShare = 8;

bool isFinite(const Surfel& s) {
  return s.position.allFinite() && s.normal.allFinite() && std::isfinite(s.radius) && std::isfinite(s.confidence);
}

Eigen::AlignedBox3f boundsOf(const std::vector<std::array<float, 4>>& places) {
  Eigen::AlignedBox3f bounds;
  for (const auto& place : places) bounds.extend(Eigen::Vector3f(place[0], place[1], place[2]));
  return bounds;
}

std::vector<ChunkRows> rowsOf(const std::vector<SurfelChunk*>& chunks) {
  std::vector<ChunkRows> rows;
  for (SurfelChunk* chunk : chunks) rows.push_back({&chunk->streams, chunk->rows});
  return rows;
}

}  // namespace

struct SurfelMap::State {
  std::shared_ptr<SurfelPool> pool;
  FusionParameters parameters;
  std::vector<std::unique_ptr<SurfelChunk>> chunks;  // in the order in which their surfels were made

  size_t firstCapacity() const {
    return std::bit_ceil(std::clamp<size_t>(parameters.initial_capacity, kBlockItems, kChunkSurfels));
  }

  // Chunks that may hold something in view; they stay for this step.
  Result<std::vector<SurfelChunk*>> chunksInView(const FramePush& frame, float farthest, float margin_px) {
    std::vector<SurfelChunk*> seen;
    for (const auto& chunk : chunks) {
      if (chunk->rows == 0 || !mayBeInView(chunk->bounds, frame, farthest, margin_px)) continue;
      if (auto done = pool->need(*chunk); !done) return done.error();
      seen.push_back(chunk.get());
    }
    return seen;
  }

  // The chunks at the end that hold room for `count` more surfels; they stay for this step. A single chunk grows, up to
  // the size of all others, so that small maps are small.
  Result<std::vector<SurfelChunk*>> makeRoom(size_t count) {
    if (chunks.empty()) {
      auto made = pool->makeChunk(firstCapacity());
      if (!made) return made.error();
      chunks.push_back(std::move(*made));
    }
    SurfelChunk& last = *chunks.back();
    const size_t wanted = std::min(last.rows + count, kChunkSurfels);
    if (auto done = pool->grow(last, std::max(last.capacity, std::bit_ceil(wanted))); !done) return done.error();
    std::vector<SurfelChunk*> targets{&last};
    for (size_t room = last.capacity - last.rows; room < count; room += kChunkSurfels) {
      auto made = pool->makeChunk(kChunkSurfels);
      if (!made) return made.error();
      chunks.push_back(std::move(*made));
      targets.push_back(chunks.back().get());
    }
    return targets;
  }

  void dropEmpty() {
    std::erase_if(chunks, [](const auto& chunk) { return chunk->rows == 0; });
  }

  // Closes gaps where they are many, and lays neighbours together that then fit into one chunk.
  Result<void> tidy() {
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
      into.rows += from.rows;
      into.gaps += from.gaps;
      into.bounds.extend(from.bounds);
      from.rows = 0;
      break;
    }
    dropEmpty();
    return {};
  }
};

Result<SurfelMap> SurfelMap::create(gpu::Device& device, const FusionParameters& parameters) {
  auto pool = SurfelPool::create(device, size_t{parameters.memory_mb} << 20);
  if (!pool) return pool.error();
  return SurfelMap(std::move(*pool), parameters);
}

SurfelMap::SurfelMap(std::shared_ptr<SurfelPool> pool, const FusionParameters& parameters)
    : state_(std::make_unique<State>()) {
  state_->pool = std::move(pool);
  state_->parameters = parameters;
}

SurfelMap::SurfelMap(SurfelMap&&) noexcept = default;
SurfelMap& SurfelMap::operator=(SurfelMap&&) noexcept = default;
SurfelMap::~SurfelMap() = default;

Result<FusionReport> SurfelMap::fuse(const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                                     const Pose& T_map_cam, uint32_t owner, uint32_t robot_bit,
                                     const Image<uint8_t>& depth_hits) {
  State& s = *state_;
  if (auto done = checkCamera(camera, T_map_cam); !done) return done.error();
  const auto fits = [&](const auto& image) { return image.width() == camera.width && image.height() == camera.height; };
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
  SurfelPool& pool = *s.pool;
  pool.beginStep();
  const FramePush frame = framePush(camera, T_map_cam, s.parameters);
  const auto seen = s.chunksInView(frame, s.parameters.depth_max_m + 1, 1);
  if (!seen) return seen.error();
  const auto targets = s.makeRoom(mostInsertions(camera));
  if (!targets) return targets.error();
  if (auto done = pool.maps.reserve(pool.context, depth.size()); !done) return done.error();
  if (auto done = pool.maps.upload(colour, depth, depth_hits, s.parameters); !done) return done.error();

  const auto seen_rows = rowsOf(*seen), target_rows = rowsOf(*targets);
  auto counts = fuseKeyframe(pool.context, pool.kernels, pool.maps, pool.scratch, s.parameters,
                             {frame, seen_rows, target_rows, owner, robot_bit});
  if (!counts) return counts.error();
  FusionReport report{counts->updated, counts->inserted, 0, 0};
  for (size_t i = 0; i < seen->size(); ++i) {
    (*seen)[i]->gaps += counts->removed[i];
    report.removed += counts->removed[i];
  }
  const Eigen::AlignedBox3f view = viewBounds(frame, s.parameters.depth_max_m);
  uint32_t left = counts->inserted;
  for (SurfelChunk* target : *targets) {
    const uint32_t taken = std::min(left, static_cast<uint32_t>(target->capacity) - target->rows);
    target->rows += taken;
    left -= taken;
    if (taken > 0) target->bounds.extend(view);
  }
  if (auto done = s.tidy(); !done) return done.error();
  report.total = static_cast<uint32_t>(size());
  return report;
}

Result<PredictedView> SurfelMap::predict(const CameraModel& camera, const Pose& T_map_cam,
                                         const PredictionOptions& options) {
  State& s = *state_;
  if (auto done = checkCamera(camera, T_map_cam); !done) return done.error();
  SurfelPool& pool = *s.pool;
  pool.beginStep();
  const FramePush frame = framePush(camera, T_map_cam, s.parameters);
  const auto seen = s.chunksInView(frame, options.max_depth_m, kFootprintMargin_px);
  if (!seen) return seen.error();
  return predictView(pool.context, pool.kernels, rowsOf(*seen), pool.prediction, frame, camera, options);
}

Result<void> SurfelMap::moveOwners(std::span<const Pose> T_new_old) {
  State& s = *state_;
  std::vector<float> rows;
  rows.reserve(T_new_old.size() * 12);
  for (size_t owner = 0; owner < T_new_old.size(); ++owner) {
    if (!T_new_old[owner].isFinite()) {
      return Error{ErrorCode::kWrongUse, "motion of keyframe " + std::to_string(owner) + " is not finite"};
    }
    const Eigen::Matrix4d matrix = T_new_old[owner].matrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) rows.push_back(static_cast<float>(matrix(row, column)));
    }
  }
  if (rows.empty() || s.chunks.empty()) return {};
  SurfelPool& pool = *s.pool;
  const size_t bytes = rows.size() * sizeof(float);
  if (pool.motions.bytes() < bytes) {
    auto motions = gpu::Buffer::create(pool.context, 2 * bytes, "owner motions");
    if (!motions) return motions.error();
    pool.motions = std::move(*motions);
  }
  if (auto done = pool.motions.write(rows.data(), bytes); !done) return done;
  for (const auto& chunk : s.chunks) {
    pool.beginStep();
    if (auto done = pool.need(*chunk); !done) return done;
    const SurfelStreams& streams = chunk->streams;
    auto recorder = gpu::Recorder::begin(pool.context);
    if (!recorder) return recorder.error();
    recorder->dispatch(*pool.kernels.move_owners, {&streams.places, &streams.shapes, &streams.looks, &pool.motions},
                       MoveOwnersPush{chunk->rows, static_cast<uint32_t>(T_new_old.size())},
                       gpu::groupsFor(chunk->rows, kBlockItems));
    if (auto done = recorder->submit(); !done) return done;
    const auto places = streams.places.read<std::array<float, 4>>(chunk->rows);
    if (!places) return places.error();
    chunk->bounds = boundsOf(*places);
  }
  return {};
}

Result<std::vector<Surfel>> SurfelMap::download() {
  std::vector<Surfel> surfels;
  surfels.reserve(size());
  for (const auto& chunk : state_->chunks) {
    const auto rows = state_->pool->rowsOf(*chunk);
    if (!rows) return rows.error();
    const auto part = unpack(*rows);
    surfels.insert(surfels.end(), part.begin(), part.end());
  }
  return surfels;
}

Result<void> SurfelMap::append(std::span<const Surfel> surfels) {
  State& s = *state_;
  for (size_t i = 0; i < surfels.size(); ++i) {
    if (!isFinite(surfels[i])) {
      return Error{ErrorCode::kBadData,
                   "surfel " + std::to_string(i) + " of " + std::to_string(surfels.size()) + " is not finite"};
    }
  }
  while (!surfels.empty()) {
    s.pool->beginStep();
    const auto targets = s.makeRoom(1);
    if (!targets) return targets.error();
    SurfelChunk& chunk = *targets->back();
    const size_t room = std::min(surfels.size(), kChunkSurfels - chunk.rows);
    if (auto done = s.pool->grow(chunk, std::max(chunk.capacity, std::bit_ceil(chunk.rows + room))); !done) return done;
    const StreamRows rows = pack(surfels.first(room));
    if (auto done = writeRows(chunk.streams, rows, chunk.rows); !done) return done;
    chunk.rows += static_cast<uint32_t>(room);
    chunk.bounds.extend(boundsOf(rows.places));
    surfels = surfels.subspan(room);
  }
  return {};
}

void SurfelMap::clear() { state_->chunks.clear(); }

size_t SurfelMap::size() const {
  size_t count = 0;
  for (const auto& chunk : state_->chunks) count += chunk->rows - chunk->gaps;
  return count;
}

}  // namespace comap
