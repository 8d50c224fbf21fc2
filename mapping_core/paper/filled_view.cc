#include "mapping_core/paper/filled_view.h"

#include <algorithm>
#include <cmath>

namespace comap {

FilledView fillView(PredictedView view, const Frame& frame, float depth_min_m, float depth_max_m) {
  FilledView filled;
  filled.colour = std::move(view.colour);
  filled.predicted_m = std::move(view.depth_m);
  filled.depth_m = filled.predicted_m;
  size_t predicted = 0;
  for (size_t i = 0; i < filled.depth_m.size(); ++i) {
    if (filled.predicted_m.data()[i] > 0) {
      ++predicted;
      continue;
    }
    filled.colour.data()[i] = frame.colour.data()[i];
    const auto z = static_cast<float>(frame.depth.data()[i] / kDepthUnitsPerMetre);
    if (z >= depth_min_m && z <= depth_max_m) filled.depth_m.data()[i] = z;
  }
  filled.dense_share = static_cast<double>(predicted) / static_cast<double>(std::max<size_t>(filled.depth_m.size(), 1));
  return filled;
}

DepthImage depthUnits(const Image<float>& depth_m) {
  DepthImage units(depth_m.width(), depth_m.height(), 0);
  for (size_t i = 0; i < depth_m.size(); ++i) {
    const double value = std::round(depth_m.data()[i] * kDepthUnitsPerMetre);
    units.data()[i] = value > 0 && value <= 65535 ? static_cast<uint16_t>(value) : uint16_t{0};
  }
  return units;
}

}  // namespace comap
