// Scalar oracle of associate, fuse, clean_up and insert: one keyframe into a list of surfels.
#pragma once

#include "tests/reference/measurement_reference.h"

namespace comap::reference {

enum class Match : uint8_t { kNone, kSupported, kFits, kMissed, kViolated };

struct Association {
  std::vector<Match> matches;  ///< per row
  std::vector<int> pixels;     ///< per row: index of its pixel
  Image<int> winners;          ///< row per pixel, -1 = none
  Image<uint8_t> covered;
};

Association associate(const View& view, const std::vector<Row>& rows, const Image<Measurement>& measurements,
                      const Image<float>& raw_inverse_depth);

/// Fuses one keyframe; removed rows are left out, new ones appended in raster order.
FusionReport fuse(const View& view, std::vector<Row>& rows, const ColourImage& colour, const DepthImage& depth,
                  const Image<uint8_t>& depth_hits, uint32_t owner, uint32_t robot_bit);

}  // namespace comap::reference
