// The chunks of one map and the steps on them that plain and timed maps share.
#pragma once

#include <memory>
#include <vector>

#include "mapping_core/surfels/surfel_pool.h"

namespace comap {

/// One keyframe or frame on its way into a map; see SurfelMap::fuse().
struct FusionInput {
  const CameraModel& camera;
  const ColourImage& colour;
  const DepthImage& depth;
  const Image<uint8_t>& depth_hits;
  Pose T_map_cam;
  uint32_t owner = 0, contributor = 0;
};

std::vector<ChunkRows> rowsOf(const std::vector<SurfelChunk*>& chunks);

/// Thread rule: as the pool's.
struct ChunkList {
  std::shared_ptr<SurfelPool> pool;
  FusionParameters parameters;
  std::vector<std::unique_ptr<SurfelChunk>> chunks;  ///< in the order in which their surfels were made

  size_t size() const;
  /// Chunks that may hold something in view; they stay for this step.
  Result<std::vector<SurfelChunk*>> chunksInView(const FramePush& frame, float farthest, float margin_px);
  /// The chunks at the end that hold room for `count` more surfels; they stay for this step. A single chunk grows, up
  /// to the size of all others, so that small maps are small.
  Result<std::vector<SurfelChunk*>> makeRoom(size_t count);
  /// If memory does not suffice, nothing of the keyframe is in the map. `times`: of a timed map, see FusionStep.
  Result<FusionReport> fuse(const FusionInput& input, const SeenStep* times);
  /// Blocks of a chunk that were changed after `moment`, as far as its moments know, with their surfels.
  Result<void> readChanged(const SurfelChunk& chunk, uint64_t moment, std::vector<SurfelBlock>& changed) const;
  Result<PredictedView> predict(const CameraModel& camera, const Pose& T_map_cam, const PredictionOptions& options,
                                const SeenStep* times);

 private:
  /// Chunks with room for `count` more surfels, by turns with those in view, which are here in the end.
  Result<std::vector<SurfelChunk*>> roomFor(uint32_t count, const std::vector<SurfelChunk*>& seen);
  Result<void> needAll(const std::vector<SurfelChunk*>& wanted);
  Result<void> insert(const FusionStep& step, uint32_t count, const std::vector<SurfelChunk*>& targets);
  size_t firstCapacity() const;
  void dropEmpty();
  Result<void> tidy();
};

}  // namespace comap
