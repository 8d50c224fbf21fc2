// Scalar oracle of filter_depth and measure, and of what a pixel says (shaders/common/measurement.glsl).
#pragma once

#include "tests/reference/camera_reference.h"

namespace comap::reference {

struct Measurement {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< in the camera's frame
  float depth = 0;                                   ///< 0 = not to be fused
};

/// Inverse depth in 1/m; 0 where there is none or it is out of range.
Image<float> inverseDepth(const DepthImage& depth, const FusionParameters& parameters);
Image<float> filterDepth(const Image<float>& inverse_depth, bool along_columns, const FusionParameters& parameters);
Image<Measurement> measure(const View& view, const Image<float>& filtered);

int strideOf(const View& view, float z);
float radiusOf(const View& view, float z, float normal_z);
float confidenceOf(float frames);
float precisionOf(const View& view, int x, int y, float z, float frames);

}  // namespace comap::reference
