#include "tests/reference/prediction_reference.h"

#include <cmath>
#include <limits>
#include <optional>

namespace comap::reference {
namespace {

struct Hit {
  float depth, relative;  // squared distance from the centre over squared radius
};

std::optional<Hit> hit(const View& view, const Surfel& s, int x, int y, const PredictionOptions& options) {
  const Eigen::Vector3f position = view.toCamera(s.position), normal = view.R_cam_map * s.normal;
  float facing = -normal.dot(position) / position.norm();
  if (options.both_sides) facing = std::abs(facing);
  if (s.confidence < options.min_confidence || position.z() <= 0.05f || position.z() >= options.max_depth_m ||
      facing <= 0.09f) {
    return std::nullopt;
  }
  const Eigen::Vector3f ray = view.ray(static_cast<float>(x), static_cast<float>(y));
  const float depth = normal.dot(position) / normal.dot(ray);
  const float relative = (ray * depth - position).squaredNorm() / (s.radius * s.radius);
  if (depth <= 0 || relative > 1) return std::nullopt;
  return Hit{depth, relative};
}

}  // namespace

PredictedView predict(const View& view, const std::vector<Surfel>& surfels, const PredictionOptions& options) {
  const CameraModel& camera = view.camera;
  PredictedView seen;
  seen.camera = camera;
  seen.depth_m = Image<float>(camera.width, camera.height);
  seen.normal = Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero());
  seen.colour = ColourImage(camera.width, camera.height);
  seen.confidence = Image<float>(camera.width, camera.height);
  seen.contributors = Image<uint32_t>(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      float front = std::numeric_limits<float>::infinity();
      for (const Surfel& s : surfels) {
        if (const auto found = hit(view, s, x, y, options)) front = std::min(front, found->depth);
      }
      uint32_t best = 511;
      for (const Surfel& s : surfels) {
        const auto found = hit(view, s, x, y, options);
        if (!found || found->depth > front + view.gate(front)) continue;
        const auto rank = static_cast<uint32_t>(found->relative * 510);
        if (rank >= best) continue;
        best = rank;
        const Eigen::Vector3f normal = view.R_cam_map * s.normal;
        seen.depth_m.at(x, y) = found->depth;
        seen.normal.at(x, y) =
            normal.dot(view.ray(static_cast<float>(x), static_cast<float>(y))) > 0 ? Eigen::Vector3f(-normal) : normal;
        seen.colour.at(x, y) = s.colour;
        seen.confidence.at(x, y) = s.confidence;
        seen.contributors.at(x, y) = s.contributors;
      }
    }
  }
  return seen;
}

Blend blend(const View& view, const std::vector<Surfel>& surfels, const PredictionOptions& options) {
  const CameraModel& camera = view.camera;
  Blend mean{Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero()),
             Image<float>(camera.width, camera.height, 0.0f)};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      float front = std::numeric_limits<float>::infinity(), weights = 0;
      for (const Surfel& s : surfels) {
        if (const auto found = hit(view, s, x, y, options)) front = std::min(front, found->depth);
      }
      for (const Surfel& s : surfels) {
        const auto found = hit(view, s, x, y, options);
        if (!found || found->depth > front + view.gate(front)) continue;
        const float weight = std::exp(-3 * found->relative);
        mean.colour.at(x, y) += weight * Eigen::Vector3f(s.colour.r, s.colour.g, s.colour.b);
        mean.confidence.at(x, y) += weight * s.confidence;
        weights += weight;
      }
      if (!(weights > 0)) continue;
      mean.colour.at(x, y) /= weights;
      mean.confidence.at(x, y) /= weights;
    }
  }
  return mean;
}

}  // namespace comap::reference
