// Colour pictures as a pinhole camera would have taken them.
#pragma once

#include <vector>

#include "edge_agent/capture/camera_rig.h"
#include "protocol/types/image.h"

namespace comap {

/// Made once for a lens; apply() may be used from several threads.
class Undistorter {
 public:
  /// Pictures come out as from `lens.pinhole` without distortion.
  explicit Undistorter(const Lens& lens);

  /// Bilinear, rounded to the nearest value; black where the lens saw nothing. A lens without distortion gives the
  /// picture as it is. The picture must have the lens' size.
  ColourImage apply(ColourImage picture) const;

 private:
  struct Source {
    int32_t offset;        // of the upper left of four pixels; < 0 = not seen
    uint16_t right, down;  // weights of the right and lower ones, of kOne
  };
  int width_, height_;
  std::vector<Source> sources_;  // empty: nothing to do
};

}  // namespace comap
