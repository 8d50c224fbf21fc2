// Depth as the colour camera would see it.
#pragma once

#include <vector>

#include "edge_agent/capture/camera_rig.h"
#include "protocol/types/image.h"

namespace comap {

/// Made once for a rig; apply() keeps working memory: one thread at a time.
class DepthRegistration {
 public:
  /// Output as seen by `target`, a pinhole in the colour camera's place; with `already_registered` the depth values
  /// come from the colour camera's own place, through its lens, and only distortion and unit remain to be dealt with.
  DepthRegistration(const CameraRig& rig, const CameraModel& target, bool already_registered);

  /// `values` as the device counts them, of the depth lens' size (the colour lens' if already registered). Each depth
  /// pixel covers what its square covers in the target; the nearest wins. Single pixels between two neighbours, left
  /// and right or above and below, that differ by less than 3 % are filled with their mean. In the project's unit,
  /// rounded to nearest; what that cannot hold, and what is not seen, is 0.
  DepthImage apply(const DepthImage& values);

  int width() const { return width_; }  ///< that values must have
  int height() const { return height_; }

 private:
  DepthImage rescaled(const DepthImage& values) const;
  void splat(const DepthImage& values);

  CameraModel target_;
  int width_, height_;
  float metres_per_value_;
  bool direct_;                                     // values stay at their pixels
  Eigen::Vector3f origin_;                          // of the depth camera, in the colour camera
  std::vector<Eigen::Vector3f> centres_, corners_;  // rays of pixels and of their corners, turned likewise
  std::vector<uint16_t> table_;                     // value to project unit
  Image<float> nearest_m_;
};

}  // namespace comap
