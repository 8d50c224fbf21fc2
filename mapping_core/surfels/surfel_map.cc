#include "mapping_core/surfels/surfel_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "mapping_core/surfels/chunk_list.h"

namespace comap {
namespace {

bool isFinite(const Surfel& s) {
  return s.position.allFinite() && s.normal.allFinite() && std::isfinite(s.radius) && std::isfinite(s.confidence);
}

// Poses that a solver left where they were come back with their last bits rounded otherwise.
bool isNone(const Pose& motion) { return (motion.matrix() - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff() < 1e-9; }

}  // namespace

struct SurfelMap::State : ChunkList {};

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
  return state_->fuse({camera, colour, depth, depth_hits, T_map_cam, owner, robot_bit}, nullptr);
}

Result<PredictedView> SurfelMap::predict(const CameraModel& camera, const Pose& T_map_cam,
                                         const PredictionOptions& options) {
  return state_->predict(camera, T_map_cam, options, nullptr);
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
  std::vector<bool> moves(T_new_old.size());
  for (size_t owner = 0; owner < moves.size(); ++owner) moves[owner] = !isNone(T_new_old[owner]);
  for (const auto& chunk : s.chunks) {
    const auto& owners = chunk->owners;
    const auto moved = [&](uint32_t owner) { return owner < moves.size() && moves[owner]; };
    if (std::none_of(owners.begin(), owners.end(), moved)) continue;
    pool.beginStep();
    if (auto done = pool.need(*chunk); !done) return done;
    const SurfelStreams& streams = chunk->streams;
    auto recorder = gpu::Recorder::begin(pool.context);
    if (!recorder) return recorder.error();
    recorder->dispatch(*pool.kernels.move_owners, {&streams.places, &streams.shapes, &streams.looks, &pool.motions},
                       MoveOwnersPush{chunk->rows, static_cast<uint32_t>(T_new_old.size())},
                       gpu::groupsFor(chunk->rows, kBlockItems));
    chunk->streams.boxed = 0;
    if (auto done = recorder->submit(); !done) return done;
    chunk->moments.markAll(chunk->rows, pool.moment());
    const auto places = streams.places.read<std::array<float, 4>>(chunk->rows);
    if (!places) return places.error();
    chunk->bounds = {};
    chunk->bounds.extend(*places);
  }
  return {};
}

Result<SurfelChanges> SurfelMap::changesSince(uint64_t moment) {
  SurfelPool& pool = *state_->pool;
  const uint64_t now = pool.endMoment();
  SurfelChanges changes{now, {}, {}};
  for (const auto& chunk : state_->chunks) {
    if (!chunk->away)
      if (auto noted = pool.noteTouched(*chunk, now); !noted) return noted.error();
    chunk->moments.noteRows(chunk->rows, now);
    for (size_t block = 0; block < chunk->moments.blocks(); ++block)
      changes.blocks.push_back(chunk->number * kChunkSurfels + block);
    if (auto read = state_->readChanged(*chunk, moment, changes.changed); !read) return read.error();
  }
  return changes;
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
    chunk.bounds.extend(rows.places);
    for (size_t i = 0; i < room; ++i)
      if (i == 0 || surfels[i].owner != surfels[i - 1].owner) chunk.owners.insert(surfels[i].owner);
    chunk.rows += static_cast<uint32_t>(room);
    surfels = surfels.subspan(room);
  }
  return {};
}

// Chunks stay where they are in memory: only their poses change.
Result<void> SurfelMap::absorb(SurfelMap& other, const Pose& T_map_other) {
  State &to = *state_, &from = *other.state_;
  if (to.pool != from.pool || &to == &from)
    return Error{ErrorCode::kWrongUse, "a map is absorbed by one that is not another of its pool"};
  uint32_t owners = 0;
  for (const auto& chunk : from.chunks)
    if (!chunk->owners.empty()) owners = std::max(owners, *chunk->owners.rbegin() + 1);
  if (auto moved = other.moveOwners(std::vector<Pose>(owners, T_map_other)); !moved) return moved;
  for (auto& chunk : from.chunks) {
    chunk->moments.markAll(chunk->rows, to.pool->moment());  // also if it did not move: it is new to this map
    to.chunks.push_back(std::move(chunk));
  }
  from.chunks.clear();
  return {};
}

void SurfelMap::clear() { state_->chunks.clear(); }

size_t SurfelMap::size() const { return state_->size(); }

}  // namespace comap
