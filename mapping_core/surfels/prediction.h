// The map as a camera would see it, by splatting discs.
#pragma once

#include "mapping_core/surfels/keyframe_maps.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "mapping_core/surfels/visible_list.h"

namespace comap {

struct PredictionBuffers {
  gpu::Buffer depths;      ///< u32 per pixel: bits of the nearest depth
  gpu::Buffer keys;        ///< u32 per pixel: relative distance << 23 | surfel
  gpu::Buffer surface;     ///< vec4 per pixel: normal in the camera's frame, depth
  gpu::Buffer appearance;  ///< uvec4 per pixel: colour, confidence bits, contributors
  VisibleList visible;
  size_t pixels = 0;

  Result<void> reserve(gpu::Context& context, size_t count);
};

/// Of the first `count` rows of `streams`.
Result<PredictedView> predictView(gpu::Context& context, const SurfelKernels& kernels, const SurfelStreams& streams,
                                  uint32_t count, PredictionBuffers& buffers, const FramePush& frame,
                                  const CameraModel& camera, const PredictionOptions& options);

}  // namespace comap
