// The map as a camera would see it, by splatting discs.
#pragma once

#include "mapping_core/surfels/fusion.h"
#include "mapping_core/surfels/keyframe_maps.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/visible_list.h"

namespace comap {

struct PredictionBuffers {
  gpu::Buffer depths;                ///< u32 per pixel: bits of the nearest depth
  gpu::Buffer keys;                  ///< u32 per pixel: relative distance << 23 | surfel of the group
  gpu::Buffer surface;               ///< vec4 per pixel: normal in the camera's frame, depth
  gpu::Buffer appearance;            ///< uvec4 per pixel: colour, confidence bits, contributors, rank
  gpu::Buffer colour_sums;           ///< four u32 per pixel; only for blended views
  gpu::Buffer normal_sums;           ///< four i32 per pixel, the last of confidence
  std::vector<VisibleList> visible;  ///< one per chunk in view
  size_t pixels = 0, blended_pixels = 0;

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
