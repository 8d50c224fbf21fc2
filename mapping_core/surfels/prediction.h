// The map as a camera would see it, by splatting discs.
#pragma once

#include "mapping_core/surfels/fusion.h"
#include "mapping_core/surfels/keyframe_maps.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/visible_list.h"

namespace comap {

struct PredictionBuffers {
  gpu::Buffer depths;                ///< u32 per pixel: bits of the nearest depth
  gpu::Buffer keys;                  ///< u32 per pixel: rank by distance << 23 | surfel of the group
  gpu::Buffer surface;               ///< four u32 per pixel: normal with colour, depth; see common/resolving.glsl
  gpu::Buffer certainty;             ///< two u32 per pixel: confidence bits, contributors
  gpu::Buffer colour_sums;           ///< four u32 per pixel; only for blended views
  gpu::Buffer normal_sums;           ///< four i32 per pixel, the last of confidence
  std::vector<VisibleList> visible;  ///< one per chunk in view
  size_t pixels = 0, blended_pixels = 0;
  size_t group_surfels = kMostSurfels;  ///< most that are compared with each other at once; fewer for tests

  Result<void> reserve(gpu::Context& context, size_t count);
  Result<void> reserveBlend(gpu::Context& context, size_t count);
};

/// Pixels that a surfel's disc may reach beyond the one its centre is seen at, see shaders/common/disc.glsl.
inline constexpr float kFootprintMargin_px = 33;

/// Of chunks that may hold something in view. `times` (null: all): only these surfels of a timed map, and
/// `contributors` of the view are the surfels' owners.
Result<PredictedView> predictView(gpu::Context& context, const SurfelKernels& kernels, std::span<const ChunkRows> seen,
                                  PredictionBuffers& buffers, const FramePush& frame, const CameraModel& camera,
                                  const PredictionOptions& options, const SeenStep* times);

}  // namespace comap
