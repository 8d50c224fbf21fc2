// How uncertain a depth measurement is (A 2.11): stereo-like sensors, sigma grows with depth squared.
#pragma once

namespace comap {

struct DepthNoiseModel {
  float floor_m = 0.001f;
  /// Kinect-class: about 0.1 px of disparity at b f = 40 m px is pessimistic; half of that fits recorded data.
  float factor_per_m = 0.0019f;

  float sigma(float depth_m) const { return floor_m + factor_per_m * depth_m * depth_m; }
};

}  // namespace comap
