// The push-constant blocks of the kernels, member by member as in shaders/.
#pragma once

#include <cstdint>

#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// FRAME_FIELDS in shaders/common/frame.glsl.
struct FramePush {
  float rows[12] = {};  ///< of T_cam_map
  float fx = 0, fy = 0, cx = 0, cy = 0;
  uint32_t width = 0, height = 0;
  float noise_floor = 0, noise_factor = 0;
};

FramePush framePush(const CameraModel& camera, const Pose& T_map_cam, const FusionParameters& parameters);

struct FilterDepthPush {
  uint32_t width, height, along_columns;
  float noise_floor, noise_factor;
};

struct AssociatePush : FramePush {
  float depth_min, depth_max, stable_confidence;
  uint32_t base;
};

struct FusePush : FramePush {
  float averaging_limit;
  uint32_t contributor, base;
};

struct CleanUpPush : FramePush {
  float stable_confidence;
  uint32_t unstable_timeout, base, chunk;
};

struct CountNewPush : FramePush {
  uint32_t candidates;
};

struct InsertPush : FramePush {
  uint32_t candidates, start, capacity, owner, contributor;
};

struct ScanBlocksPush {
  uint32_t count, total_slot;
};

struct CountAlivePush {
  uint32_t count;
};

struct CompactPush {
  uint32_t count, pairs;
};

struct BoundBlocksPush {
  uint32_t first, count;
};

struct ListBlocksPush : FramePush {
  uint32_t count;
  float max_depth, margin;
};

struct ListVisiblePush : FramePush {
  uint32_t count;
  float min_confidence, max_depth, margin;
};

struct ListSeenPush : ListVisiblePush {
  uint32_t camera, tick, window, inactive;
};

struct StampFusedPush {
  uint32_t base, camera, tick;
};

struct StampNewPush {
  uint32_t candidates, slot, start, capacity, camera, tick;
};

struct ExpirePush {
  uint32_t count, chunk, tick, timeout;
  float stable_confidence;
};

/// Of both splats and resolve.
struct SplatPush : FramePush {
  float min_confidence, max_depth;
  uint32_t both_sides, base, count, clears;
};

struct CarryRanksPush {
  uint32_t count;
};

struct MoveOwnersPush {
  uint32_t count, owners;
};

}  // namespace comap
