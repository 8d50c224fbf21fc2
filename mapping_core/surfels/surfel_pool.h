// The device memory of all maps of one core: chunks of surfels, and what one fusion or prediction needs besides.
// Chunks that nothing has needed for longest leave for a file when memory ends, and come back when they are needed.
#pragma once

#include <Eigen/Geometry>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "mapping_core/surfels/block_moments.h"
#include "mapping_core/surfels/chunk_bounds.h"
#include "mapping_core/surfels/fusion.h"
#include "mapping_core/surfels/prediction.h"

namespace comap {

/// Rows of the largest chunk. A map of more surfels has several: no buffer grows with the map.
inline constexpr size_t kChunkSurfels = size_t{1} << 19;

class SurfelPool;

/// A part of a map, in the order in which surfels were made. Lives at one place in memory.
struct SurfelChunk {
  explicit SurfelChunk(SurfelPool& owner) : pool(owner) {}
  SurfelChunk(const SurfelChunk&) = delete;
  SurfelChunk& operator=(const SurfelChunk&) = delete;
  ~SurfelChunk();

  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  SurfelPool& pool;
  SurfelStreams streams;  ///< of capacity 0 while the chunk is away
  uint32_t rows = 0;      ///< in use, gaps included
  uint32_t gaps = 0;
  std::set<uint32_t> owners;  ///< of all surfels, and maybe of some that are gone
  ChunkBounds bounds;         ///< of the rows' positions, to the decimetre
  BlockMoments moments;       ///< when its blocks changed last
  size_t capacity = 0;        ///< also while away
  uint64_t used = 0;          ///< when it was last needed, by the pool's clock
  uint64_t number = 0;        ///< among all that the pool has made
  std::unique_ptr<std::FILE, CloseFile> away;
};

/// Thread rule: as the device's. The pool must outlive its chunks.
class SurfelPool {
 public:
  /// `memory_bytes`: what chunks may take on the device, 0 = as much as it gives.
  /// `timed`: its surfels know when each camera last saw them (timed_surfel_map.h).
  static Result<std::shared_ptr<SurfelPool>> create(gpu::Device& device, size_t memory_bytes, bool timed = false);
  SurfelPool(const SurfelPool&) = delete;
  SurfelPool& operator=(const SurfelPool&) = delete;

  /// Begins a step: chunks that are needed from now on stay until the next.
  void beginStep() { ++clock_; }
  /// An empty chunk. kOutOfMemory if there is no room though all that this step does not need has left.
  Result<std::unique_ptr<SurfelChunk>> makeChunk(size_t capacity);
  /// Brings a chunk back if it is away, and keeps it for this step. Errors as makeChunk, or the file's.
  Result<void> need(SurfelChunk& chunk);
  /// Room for `capacity` rows; rows stay.
  Result<void> grow(SurfelChunk& chunk, size_t capacity);
  /// Closes the gaps of a chunk.
  Result<void> compact(SurfelChunk& chunk);
  /// The moment of changes that are made now. A question about changes ends it: what comes after is later.
  uint64_t moment() const { return moment_; }
  uint64_t endMoment() { return moment_++; }
  /// Takes what fusions have touched of a chunk that is here into its moments.
  Result<void> noteTouched(SurfelChunk& chunk, uint64_t moment);
  /// All rows of a chunk, wherever it is.
  Result<StreamRows> rowsOf(const SurfelChunk& chunk) { return rowsOf(chunk, 0, chunk.rows); }
  /// Some of them.
  Result<StreamRows> rowsOf(const SurfelChunk& chunk, size_t first, size_t count);

  size_t chunksAway() const;
  /// Bytes that chunks take on the device, those kept for the next chunk included.
  size_t bytes() const { return bytes_; }

  gpu::Context& context;
  SurfelKernels kernels;
  std::optional<TimedKernels> timed;
  KeyframeMaps maps;
  FusionScratch scratch;
  PredictionBuffers prediction;
  gpu::Buffer motions;

 private:
  friend struct SurfelChunk;
  SurfelPool(gpu::Context& on, size_t memory_bytes) : context(on), memory_bytes_(memory_bytes) {}
  Result<SurfelStreams> take(size_t capacity);
  size_t surfelBytes() const;
  void giveBack(SurfelStreams streams);
  void release(SurfelStreams streams);
  void dropSpare();
  Result<bool> sendOneAway();

  size_t memory_bytes_ = 0, bytes_ = 0;
  uint64_t clock_ = 0, moment_ = 1, chunks_made_ = 0;
  std::set<SurfelChunk*> chunks_;
  std::map<size_t, SurfelStreams> spare_;  // by capacity
};

}  // namespace comap
