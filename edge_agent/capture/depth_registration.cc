#include "edge_agent/capture/depth_registration.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace comap {
namespace {

constexpr float kSameSurface = 0.03f;
constexpr float kSeam_px = 0.02f;  // so that squares that a turn has moved apart by rounding still touch
constexpr float kNone = std::numeric_limits<float>::infinity();

uint16_t toUnit(double depth_m) {
  const double value = std::floor(depth_m * kDepthUnitsPerMetre + 0.5);
  return value > 0 && value <= 65535 ? static_cast<uint16_t>(value) : uint16_t{0};
}

// The mean of two depths that belong to one surface, else nothing.
float between(float a, float b) {
  if (a == kNone || b == kNone || std::abs(a - b) > kSameSurface * std::min(a, b)) return kNone;
  return (a + b) / 2;
}

}  // namespace

DepthRegistration::DepthRegistration(const CameraRig& rig, const CameraModel& target, bool already_registered)
    : target_(target), metres_per_value_(static_cast<float>(1 / rig.depth_units_per_m)) {
  const Lens& lens = already_registered ? rig.colour : rig.depth;
  const Pose T_colour_depth = already_registered ? Pose() : rig.T_colour_depth;
  width_ = lens.pinhole.width;
  height_ = lens.pinhole.height;
  direct_ = lens.straight() && lens.pinhole == target && T_colour_depth.angle() == 0 &&
            T_colour_depth.translation().norm() == 0;
  table_.resize(65536);
  for (size_t value = 0; value < table_.size(); ++value)
    table_[value] = toUnit(static_cast<double>(value) / rig.depth_units_per_m);
  if (direct_) return;
  origin_ = T_colour_depth.translation().cast<float>();
  const Eigen::Matrix3d R = T_colour_depth.rotationMatrix();
  const auto turned = [&](double u, double v) -> Eigen::Vector3f {
    const auto ray = lens.rayOf(u, v);
    if (!ray) return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    return (R * Eigen::Vector3d(ray->x(), ray->y(), 1)).cast<float>();
  };
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) centres_.push_back(turned(x, y));
  for (int y = 0; y <= height_; ++y)
    for (int x = 0; x <= width_; ++x) corners_.push_back(turned(x - 0.5, y - 0.5));
}

DepthImage DepthRegistration::rescaled(const DepthImage& values) const {
  DepthImage made(width_, height_);
  std::transform(values.data(), values.data() + values.size(), made.data(),
                 [this](uint16_t value) { return table_[value]; });
  return made;
}

void DepthRegistration::splat(const DepthImage& values) {
  const float fx = static_cast<float>(target_.fx), fy = static_cast<float>(target_.fy);
  const float cx = static_cast<float>(target_.cx), cy = static_cast<float>(target_.cy);
  const float width = static_cast<float>(target_.width), height = static_cast<float>(target_.height);
  nearest_m_ = Image<float>(target_.width, target_.height, kNone);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const uint16_t value = values.at(x, y);
      if (value == 0) continue;
      const float z = static_cast<float>(value) * metres_per_value_;
      const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
      const float depth = centres_[pixel].z() * z + origin_.z();
      const size_t corner = pixel + static_cast<size_t>(y);  // a row of corners has one more
      const Eigen::Vector3f first = corners_[corner] * z + origin_;
      const Eigen::Vector3f last = corners_[corner + static_cast<size_t>(width_) + 2] * z + origin_;
      if (!(depth > 0) || !(first.z() > 0) || !(last.z() > 0)) continue;  // behind, or no ray
      const float u0 = fx * first.x() / first.z() + cx - kSeam_px, v0 = fy * first.y() / first.z() + cy - kSeam_px;
      const float u1 = fx * last.x() / last.z() + cx, v1 = fy * last.y() / last.z() + cy;
      if (!(u1 > 0 && v1 > 0 && u0 < width && v0 < height)) continue;
      const int right = static_cast<int>(std::ceil(std::min(u1, width))),
                left = static_cast<int>(std::ceil(std::max(u0, 0.f)));
      const int bottom = static_cast<int>(std::ceil(std::min(v1, height))),
                top = static_cast<int>(std::ceil(std::max(v0, 0.f)));
      for (int v = top; v < bottom; ++v)
        for (int u = left; u < right; ++u) nearest_m_.at(u, v) = std::min(nearest_m_.at(u, v), depth);
    }
  }
}

DepthImage DepthRegistration::apply(const DepthImage& values) {
  assert(values.width() == width_ && values.height() == height_);
  if (direct_) return rescaled(values);
  splat(values);
  DepthImage made(target_.width, target_.height);
  for (int y = 0; y < target_.height; ++y) {
    for (int x = 0; x < target_.width; ++x) {
      float depth = nearest_m_.at(x, y);
      if (depth == kNone && x > 0 && x + 1 < target_.width)
        depth = between(nearest_m_.at(x - 1, y), nearest_m_.at(x + 1, y));
      if (depth == kNone && y > 0 && y + 1 < target_.height)
        depth = between(nearest_m_.at(x, y - 1), nearest_m_.at(x, y + 1));
      made.at(x, y) = depth == kNone ? uint16_t{0} : toUnit(depth);
    }
  }
  return made;
}

}  // namespace comap
