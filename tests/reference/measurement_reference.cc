#include "tests/reference/measurement_reference.h"

#include <algorithm>
#include <cmath>

namespace comap::reference {

Image<float> inverseDepth(const DepthImage& depth, const FusionParameters& parameters) {
  Image<float> inverse(depth.width(), depth.height());
  for (size_t i = 0; i < depth.size(); ++i) {
    const float z = static_cast<float>(depth.data()[i] / kDepthUnitsPerMetre);
    if (z >= parameters.depth_min_m && z <= parameters.depth_max_m) inverse.data()[i] = 1 / z;
    if (z > parameters.depth_max_m && z <= parameters.free_max_m) inverse.data()[i] = -1 / z;
  }
  return inverse;
}

Image<float> filterDepth(const Image<float>& inverse_depth, bool along_columns, const FusionParameters& parameters) {
  Image<float> filtered(inverse_depth.width(), inverse_depth.height());
  for (int y = 0; y < filtered.height(); ++y) {
    for (int x = 0; x < filtered.width(); ++x) {
      const float centre = inverse_depth.at(x, y);
      if (centre <= 0) continue;
      const double sigma = 3 * (parameters.noise_floor_m * centre * centre + parameters.noise_factor_per_m);
      double sum = centre, weights = 1;
      for (int k = 1; k <= 6; ++k) {
        const int dx = along_columns ? 0 : k, dy = along_columns ? k : 0;
        if (!inverse_depth.contains(x - dx, y - dy) || !inverse_depth.contains(x + dx, y + dy)) continue;
        const double before = inverse_depth.at(x - dx, y - dy), after = inverse_depth.at(x + dx, y + dy);
        if (before <= 0 || after <= 0) continue;
        const double difference = std::max(std::abs(before - centre), std::abs(after - centre));
        const double weight = std::exp(-k * k / (2 * 4.5 * 4.5) - difference * difference / (2 * sigma * sigma));
        sum += weight * (before + after);
        weights += 2 * weight;
      }
      filtered.at(x, y) = static_cast<float>(sum / weights);
    }
  }
  return filtered;
}

Image<Measurement> measure(const View& view, const Image<float>& filtered) {
  Image<Measurement> measurements(filtered.width(), filtered.height());
  for (int y = 2; y + 2 < filtered.height(); ++y) {
    for (int x = 2; x + 2 < filtered.width(); ++x) {
      const float d = filtered.at(x, y), l = filtered.at(x - 2, y), r = filtered.at(x + 2, y);
      const float u = filtered.at(x, y - 2), b = filtered.at(x, y + 2);
      if (d <= 0 || l <= 0 || r <= 0 || u <= 0 || b <= 0) continue;
      const float sigma = view.sigma(1 / d) * d * d, per_slope = 2 * d / view.focal();
      const float edge = std::max({std::abs(l - d), std::abs(r - d), std::abs(u - d), std::abs(b - d)});
      const float bend = std::max(std::abs(l + r - 2 * d), std::abs(u + b - 2 * d));
      if (edge >= 3 * sigma + 5.67f * per_slope || bend >= 2 * sigma + 2 * per_slope) continue;
      const auto point = [&](int px, int py) -> Eigen::Vector3f {
        return view.ray(static_cast<float>(px), static_cast<float>(py)) / filtered.at(px, py);
      };
      Eigen::Vector3f normal =
          (point(x + 2, y) - point(x - 2, y)).cross(point(x, y + 2) - point(x, y - 2)).normalized();
      const float cosine = normal.dot(view.ray(static_cast<float>(x), static_cast<float>(y)).normalized());
      if (std::abs(cosine) <= 0.17f) continue;
      measurements.at(x, y) = {cosine > 0 ? Eigen::Vector3f(-normal) : normal, 1 / d};
    }
  }
  return measurements;
}

int strideOf(const View& view, float z) {
  const float pixel_m = z / view.focal();
  return pixel_m >= 0.00125f ? 2 : pixel_m >= 0.000625f ? 4 : 8;
}

float radiusOf(const View& view, float z, float normal_z) {
  return 0.85f * static_cast<float>(strideOf(view, z)) * z / view.focal() / std::max(std::abs(normal_z), 0.25f);
}

namespace {

float radialWeight(const View& view, int x, int y) {
  const double dx = x - view.camera.cx, dy = y - view.camera.cy, w = view.camera.width / 2.0,
               h = view.camera.height / 2.0;
  return static_cast<float>(std::exp(-(dx * dx + dy * dy) / (w * w + h * h) / 0.72));
}

}  // namespace

float confidenceOf(float frames) { return 1 + (frames - 1) / 14; }

float precisionOf(const View& view, int x, int y, float z, float frames) {
  const float ratio = view.sigma(2) / view.sigma(z);
  return radialWeight(view, x, y) * std::clamp(ratio * ratio, 0.02f, 8.0f) * (1 + (frames - 1) / 3);
}

}  // namespace comap::reference
