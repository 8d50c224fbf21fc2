// Images as plain values, row by row without padding.
#pragma once

#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

#include "protocol/types/camera.h"

namespace comap {

struct Rgb {
  uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};

template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T fill = T{})
      : width_(width), height_(height), pixels_(static_cast<size_t>(width) * static_cast<size_t>(height), fill) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  size_t size() const { return pixels_.size(); }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  T& at(int x, int y) { return pixels_[index(x, y)]; }
  const T& at(int x, int y) const { return pixels_[index(x, y)]; }
  T* row(int y) { return pixels_.data() + index(0, y); }
  const T* row(int y) const { return pixels_.data() + index(0, y); }
  T* data() { return pixels_.data(); }
  const T* data() const { return pixels_.data(); }

  bool operator==(const Image&) const = default;

 private:
  size_t index(int x, int y) const {
    assert(x >= 0 && y >= 0 && x < width_ && y <= height_);
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  int width_ = 0, height_ = 0;
  std::vector<T> pixels_;
};

using ColourImage = Image<Rgb>;

/// Depth along the optical axis in units of 0.2 mm (kDepthUnitsPerMetre to the metre); 0 = none.
/// One unit everywhere, in memory, on the wire and in the store: exact for sources of 1/1000 m and of 1/5000 m.
using DepthImage = Image<uint16_t>;
inline constexpr double kDepthUnitsPerMetre = 5000.0;

/// One RGB-D pair; depth registered to colour, both of camera.width x camera.height.
struct Frame {
  int64_t stamp_ns = 0;
  CameraModel camera;
  ColourImage colour;
  DepthImage depth;
};

}  // namespace comap
