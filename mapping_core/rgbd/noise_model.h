// How uncertain a depth measurement is: stereo-like sensors, sigma grows with depth squared.
#pragma once

namespace comap {

struct DepthNoiseModel {
  float floor_m = 0.001f;
  /// Kinect-class. 0.1 px of disparity error at b f = 40 m px would be 0.0025, which is pessimistic.
  float factor_per_m = 0.0019f;

  float sigma(float depth_m) const { return floor_m + factor_per_m * depth_m * depth_m; }
};

}  // namespace comap
