#include "edge_agent/keyframes/far_depth.h"

namespace comap {

void takeFarDepth(const DepthImage& depth, float range_m, DepthImage& far) {
  if (far.width() != depth.width() || far.height() != depth.height()) far = DepthImage(depth.width(), depth.height());
  const double range = range_m * kDepthUnitsPerMetre;
  for (size_t i = 0; i < depth.size(); ++i) far.data()[i] = depth.data()[i] > range ? depth.data()[i] : uint16_t{0};
}

void fillFarDepth(const DepthImage& far, Image<float>& depth_m) {
  for (size_t i = 0; i < depth_m.size(); ++i) {
    if (depth_m.data()[i] > 0 || far.data()[i] == 0) continue;
    depth_m.data()[i] = static_cast<float>(far.data()[i] / kDepthUnitsPerMetre);
  }
}

}  // namespace comap
