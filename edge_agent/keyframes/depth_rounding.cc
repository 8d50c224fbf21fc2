#include "edge_agent/keyframes/depth_rounding.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace comap {
namespace {

// The predictor of the depth codec: left plus above minus corner, within the two neighbours. `rank` points at a pixel
// of an image with one more column on the left and one more row above.
int predict(const int* rank, ptrdiff_t stride) {
  const int left = rank[-1], above = rank[-stride], corner = rank[-stride - 1];
  const auto [low, high] = std::minmax(left, above);
  return std::clamp(left + above - corner, low, high);
}

}  // namespace

DepthImage roundDepth(const Image<float>& depth_m, const DepthRounding& rounding) {
  constexpr float kFarthest_m = 65535.0f / static_cast<float>(kDepthUnitsPerMetre);
  DepthImage rounded(depth_m.width(), depth_m.height());
  const ptrdiff_t stride = depth_m.width() + 1;
  std::vector<int> ranks(static_cast<size_t>(stride) * static_cast<size_t>(depth_m.height() + 1), 0);
  const float reach = rounding.tolerance + 0.5f;
  for (int y = 0; y < depth_m.height(); ++y) {
    int* row = ranks.data() + static_cast<ptrdiff_t>(y + 1) * stride + 1;
    row[-1] = row[-stride];  // the column on the left holds what stands above it
    for (int x = 0; x < depth_m.width(); ++x) {
      const int predicted = predict(row + x, stride);
      const float z = depth_m.at(x, y);
      if (!(z > 0) || z >= kFarthest_m) {
        row[x] = predicted;
        continue;
      }
      const float exact = 1 / (z * rounding.step_per_m);
      const float off = exact - static_cast<float>(predicted);
      const int rank = std::abs(off) <= reach ? predicted : static_cast<int>(std::lround(exact));
      row[x] = std::max(rank, 1);
      const double units =
          kDepthUnitsPerMetre / (static_cast<double>(row[x]) * static_cast<double>(rounding.step_per_m));
      rounded.at(x, y) = static_cast<uint16_t>(std::clamp(std::lround(units), 1l, 65535l));
    }
  }
  return rounded;
}

Image<uint8_t> fewestOfBlocks(const Image<uint8_t>& hits, int side) {
  Image<uint8_t> blocks((hits.width() + side - 1) / side, (hits.height() + side - 1) / side);
  for (int y = 0; y < hits.height(); ++y)
    for (int x = 0; x < hits.width(); ++x) {
      uint8_t& block = blocks.at(x / side, y / side);
      const uint8_t value = hits.at(x, y);
      if (value != 0 && (block == 0 || value < block)) block = value;
    }
  return blocks;
}

}  // namespace comap
