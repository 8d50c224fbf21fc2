#include "edge_agent/capture/undistort.h"

#include <cassert>
#include <cmath>

namespace comap {
namespace {

constexpr int kOne = 256;

}  // namespace

Undistorter::Undistorter(const Lens& lens) : width_(lens.pinhole.width), height_(lens.pinhole.height) {
  if (lens.straight()) return;
  const CameraModel& to = lens.pinhole;
  sources_.reserve(static_cast<size_t>(width_) * static_cast<size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Eigen::Vector2d at = lens.pixelOf((x - to.cx) / to.fx, (y - to.cy) / to.fy);
      const bool seen = at.x() >= 0 && at.y() >= 0 && at.x() <= width_ - 1 && at.y() <= height_ - 1;
      if (!seen) {
        sources_.push_back({-1, 0, 0});
        continue;
      }
      // The last column and row have no neighbour: they are reached from the one before with its whole weight.
      const int left = std::min(static_cast<int>(at.x()), std::max(width_ - 2, 0));
      const int top = std::min(static_cast<int>(at.y()), std::max(height_ - 2, 0));
      sources_.push_back({top * width_ + left, static_cast<uint16_t>(std::lround((at.x() - left) * kOne)),
                          static_cast<uint16_t>(std::lround((at.y() - top) * kOne))});
    }
  }
}

ColourImage Undistorter::apply(ColourImage picture) const {
  assert(picture.width() == width_ && picture.height() == height_);
  if (sources_.empty()) return picture;
  ColourImage made(width_, height_);
  const int step_x = width_ > 1 ? 1 : 0, step_y = height_ > 1 ? width_ : 0;
  Rgb* out = made.data();
  for (const Source& source : sources_) {
    Rgb& to = *out++;
    if (source.offset < 0) continue;
    const Rgb* from = picture.data() + source.offset;
    const int right = source.right, down = source.down;
    const int a = (kOne - right) * (kOne - down), b = right * (kOne - down), c = (kOne - right) * down,
              d = right * down;
    const auto mix = [&](uint8_t Rgb::*channel) {
      const int sum = a * (from[0].*channel) + b * (from[step_x].*channel) + c * (from[step_y].*channel) +
                      d * (from[step_x + step_y].*channel);
      return static_cast<uint8_t>((sum + kOne * kOne / 2) / (kOne * kOne));
    };
    to = {mix(&Rgb::r), mix(&Rgb::g), mix(&Rgb::b)};
  }
  return made;
}

}  // namespace comap
