#include "edge_agent/keyframes/keyframe_selector.h"

#include <algorithm>
#include <vector>

namespace comap {

std::string_view keyframeReason(const TrackedFrame& tracked, int frames_since, double median_depth_m,
                                TrackingState previous_state, const KeyframeOptions& options) {
  if (tracked.first) return "first";
  // A pose that was only coasted to is no measurement: it must not become an edge.
  if (tracked.state == TrackingState::kLost || !tracked.aligned) return {};
  if (tracked.state != previous_state) return "state";
  const double reach = options.translation_m * std::max(0.25, median_depth_m / 2);
  if (tracked.T_keyframe_cam.translation().norm() > reach) return "translation";
  if (tracked.T_keyframe_cam.angle() > options.rotation_rad) return "rotation";
  if (tracked.alignment.overlap < options.overlap) return "overlap";
  if (frames_since >= options.max_frames) return "frames";
  return {};
}

double medianDepth(const DepthImage& depth) {
  std::vector<uint16_t> samples;
  samples.reserve(depth.size() / 64 + 1);
  for (int y = 0; y < depth.height(); y += 8)
    for (int x = 0; x < depth.width(); x += 8)
      if (depth.at(x, y) != 0) samples.push_back(depth.at(x, y));
  if (samples.empty()) return 0;
  const auto middle = samples.begin() + static_cast<long>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return *middle / kDepthUnitsPerMetre;
}

}  // namespace comap
