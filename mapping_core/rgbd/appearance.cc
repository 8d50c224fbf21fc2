#include "mapping_core/rgbd/appearance.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

namespace comap {
namespace {

constexpr int kShift = 1;                // pixels that a patch may be off
constexpr float kSeenShare = 0.6f;       // of a patch
constexpr float kSurfaceGate_m = 0.03f;  // or four sigma

struct Sample {
  float grey;
  float u, v;  // in the frame
};

float greyAt(const Image<float>& grey, float u, float v) {
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
  return (1 - b) * ((1 - a) * grey.at(x, y) + a * grey.at(x + 1, y)) +
         b * ((1 - a) * grey.at(x, y + 1) + a * grey.at(x + 1, y + 1));
}

// Pixels of the patch that show the same surface in both views.
void collect(const PyramidLevel& reference, const PyramidLevel& frame, const Eigen::Matrix3f& r,
             const Eigen::Vector3f& t, const DepthNoiseModel& noise, int px, int py, int size,
             std::vector<Sample>& samples) {
  samples.clear();
  const CameraModel& k = frame.camera;
  const float u_max = static_cast<float>(frame.grey.width() - 2 - kShift),
              v_max = static_cast<float>(frame.grey.height() - 2 - kShift);
  for (int y = py; y < py + size; ++y)
    for (int x = px; x < px + size; ++x) {
      const float z = reference.depth_m.at(x, y);
      if (z <= 0) continue;
      const Eigen::Vector3f q = r * reference.camera.unproject(x, y, z).cast<float>() + t;
      if (q.z() < 0.2f) continue;
      const float u = static_cast<float>(k.fx) * q.x() / q.z() + static_cast<float>(k.cx);
      const float v = static_cast<float>(k.fy) * q.y() / q.z() + static_cast<float>(k.cy);
      if (!(u >= kShift && v >= kShift && u <= u_max && v <= v_max)) continue;
      const float d = frame.depth_m.at(static_cast<int>(u + 0.5f), static_cast<int>(v + 0.5f));
      if (d <= 0 || std::abs(d - q.z()) > std::max(kSurfaceGate_m, 4 * noise.sigma(d))) continue;
      samples.push_back({reference.grey.at(x, y), u, v});
    }
}

struct Likeness {
  float reference_deviation = 0, frame_deviation = 0;
  float correlation = -1;  // the best over all shifts
};

Likeness compare(const std::vector<Sample>& samples, const Image<float>& grey) {
  const auto n = static_cast<float>(samples.size());
  float mean = 0, square = 0;
  for (const Sample& s : samples) mean += s.grey / n;
  for (const Sample& s : samples) square += (s.grey - mean) * (s.grey - mean);
  Likeness likeness;
  likeness.reference_deviation = std::sqrt(square / n);
  for (int dy = -kShift; dy <= kShift; ++dy)
    for (int dx = -kShift; dx <= kShift; ++dx) {
      float sum = 0, own = 0, cross = 0;
      for (const Sample& s : samples) {
        const float other = greyAt(grey, s.u + static_cast<float>(dx), s.v + static_cast<float>(dy));
        sum += other;
        own += other * other;
        cross += other * (s.grey - mean);
      }
      own = std::max(0.0f, own - sum * sum / n);
      if (dx == 0 && dy == 0) likeness.frame_deviation = std::sqrt(own / n);
      likeness.correlation = std::max(likeness.correlation, cross / std::max(1e-3f, std::sqrt(square * own)));
    }
  return likeness;
}

}  // namespace

Appearance compareAppearance(const PyramidLevel& reference, const PyramidLevel& frame, const Pose& T_ref_frame,
                             const DepthNoiseModel& noise, const AppearanceOptions& options) {
  const Pose T_frame_ref = T_ref_frame.inverse();
  const Eigen::Matrix3f r = T_frame_ref.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_frame_ref.translation().cast<float>();
  const int size = options.patch_pixels;
  const auto fewest = static_cast<size_t>(kSeenShare * static_cast<float>(size * size));
  Appearance result;
  std::vector<Sample> samples;
  for (int y = 0; y + size <= reference.grey.height(); y += size)
    for (int x = 0; x + size <= reference.grey.width(); x += size) {
      collect(reference, frame, r, t, noise, x, y, size, samples);
      if (samples.size() < fewest) continue;
      ++result.patches;
      const Likeness likeness = compare(samples, frame.grey);
      result.features += std::min(likeness.reference_deviation, likeness.frame_deviation) >= options.feature;
      if (std::max(likeness.reference_deviation, likeness.frame_deviation) < options.texture) continue;
      ++result.textured;
      result.unlike += likeness.correlation < options.alike;
    }
  return result;
}

}  // namespace comap
