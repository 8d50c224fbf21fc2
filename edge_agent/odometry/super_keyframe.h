// A keyframe whose depth is the mean of all frames of its window: the frames tracked until the next keyframe, warped
// into it. Sensor noise averages out, holes close, and what only one frame saw is dropped.
#pragma once

#include <cstdint>
#include <vector>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

class RowWorkers;

/// Thread rule: one caller at a time; rows are shared among the workers. Allocates nothing after the first keyframe of
/// a size.
class SuperKeyframe {
 public:
  explicit SuperKeyframe(const DepthNoiseModel& noise, RowWorkers* workers = nullptr)
      : noise_(noise), workers_(workers) {}

  /// Begins a window with the keyframe's own depth: level 0 of its pyramid.
  void start(const PyramidLevel& keyframe);

  /// Averages in one more frame of the window: inverse depth, each measurement by its weight 1/sigma^2, those beyond
  /// three sigma left out. Frames of another size than the keyframe's, and more than 200, change nothing.
  void add(const PyramidLevel& frame, const Pose& T_keyframe_cam);

  /// Takes in the mean depth of the keyframe before, as if it were so many `frames`. It is no hit of this window.
  void inherit(const PyramidLevel& before, const Pose& T_keyframe_before, float frames);

  /// Means where measurements agree; 0 where none do: where more frames saw through the pixel than confirmed it, or
  /// where only one frame filled a hole. Reuses the image's memory.
  void writeDepth(Image<float>& depth_m) const;

  /// How many frames of the window agree on each pixel, 0 where there is no depth.
  void writeHits(Image<uint8_t>& hits) const;

  int frames() const { return frames_; }  ///< of the window so far, the keyframe included
  const CameraModel& camera() const { return camera_; }

 private:
  struct HolePixel {
    int32_t target = -1;  // pixel of the keyframe; -1: none
    float inverse_depth = 0;
  };
  void average(const PyramidLevel& frame, const Pose& T_keyframe_cam, float frames, int32_t hits);
  void fillHoles(const PyramidLevel& frame, const Pose& T_keyframe_cam);
  bool holds(size_t pixel) const;

  DepthNoiseModel noise_;
  RowWorkers* workers_;
  CameraModel camera_;
  int frames_ = 0;
  std::vector<float> inverse_depth_;    // 1/m, 0 = nothing yet
  std::vector<float> weight_;           // sum of 1/sigma^2, of inverse depth
  std::vector<int32_t> counts_;         // frames that agree, plus kSeenThrough for each that saw through, plus kFilled
  std::vector<HolePixel> hole_pixels_;  // where a frame's pixels fall, memory only
};

}  // namespace comap
