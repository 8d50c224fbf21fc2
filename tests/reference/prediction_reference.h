// Scalar oracle of the three passes of a prediction, by trying every disc at every pixel.
#pragma once

#include "tests/reference/camera_reference.h"

namespace comap::reference {

PredictedView predict(const View& view, const std::vector<Surfel>& surfels, const PredictionOptions& options);

/// What PredictionOptions::blend puts in the place of colour and confidence, 0 where nothing is seen.
struct Blend {
  Image<Eigen::Vector3f> colour;
  Image<float> confidence;
};
Blend blend(const View& view, const std::vector<Surfel>& surfels, const PredictionOptions& options);

}  // namespace comap::reference
