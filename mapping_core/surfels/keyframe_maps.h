// A keyframe's images on the device, from the depth as shipped to measurements that can be fused.
#pragma once

#include "mapping_core/gpu/recorder.h"
#include "mapping_core/surfels/push_constants.h"
#include "mapping_core/surfels/surfel_kernels.h"

namespace comap {

struct KeyframeMaps {
  gpu::Buffer raw;           ///< float per pixel: inverse depth in 1/m, 0 = none, negative = too far to be fused
  gpu::Buffer rows;          ///< float: filtered along rows
  gpu::Buffer filtered;      ///< float: filtered both ways
  gpu::Buffer measurements;  ///< vec4: normal in the camera's frame, depth in m or 0
  gpu::Buffer colours;       ///< u32: r | g << 8 | b << 16 | frames whose mean the depth is << 24
  gpu::Buffer winners;       ///< u32, see shaders/common/surfel.glsl: one per pixel, then eight per pixel
  gpu::Buffer covered;       ///< u32: 1 where no new surfel is needed
  size_t pixels = 0;

  /// Makes room for images of `count` pixels.
  Result<void> reserve(gpu::Context& context, size_t count);
  /// `depth_hits` as in Keyframe.
  Result<void> upload(const ColourImage& colour, const DepthImage& depth, const Image<uint8_t>& depth_hits,
                      const FusionParameters& parameters);
  void recordMeasure(gpu::Recorder& recorder, const SurfelKernels& kernels, const FramePush& frame) const;
};

/// What a camera or its images would make the kernels misbehave with, if anything: kWrongUse.
Result<void> checkCamera(const CameraModel& camera, const Pose& T_map_cam);

}  // namespace comap
