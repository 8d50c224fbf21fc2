#include "edge_agent/keyframes/keyframe_selector.h"

#include <algorithm>
#include <array>

namespace comap {

std::string_view keyframeReason(const TrackedFrame& tracked, int frames_since, double median_depth_m,
                                const KeyframeOptions& options) {
  if (tracked.first) return "first";
  // A pose that was only coasted to is no measurement: it must not become an edge.
  if (tracked.state == TrackingState::kLost || !tracked.aligned) return {};
  // Not after every frame that was merely passed over: a camera that fails now and then would make all others
  // keyframes.
  if (tracked.changed) return "state";
  const double reach = options.translation_m * std::max(0.25, median_depth_m / 2);
  if (tracked.T_keyframe_cam.translation().norm() > reach) return "translation";
  if (tracked.T_keyframe_cam.angle() > options.rotation_rad) return "rotation";
  if (tracked.alignment.overlap < options.overlap) return "overlap";
  if (frames_since >= options.max_frames) return "frames";
  return {};
}

double medianDepth(const DepthImage& depth) {
  // A fixed number of samples at most, so that nothing is allocated per frame.
  std::array<uint16_t, 4800> samples;
  int step = 1;
  while (((depth.width() + step - 1) / step) * ((depth.height() + step - 1) / step) > static_cast<int>(samples.size()))
    ++step;
  size_t count = 0;
  for (int y = 0; y < depth.height(); y += step)
    for (int x = 0; x < depth.width(); x += step)
      if (depth.at(x, y) != 0) samples[count++] = depth.at(x, y);
  if (count == 0) return 0;
  const auto middle = samples.begin() + static_cast<long>(count / 2);
  std::nth_element(samples.begin(), middle, samples.begin() + static_cast<long>(count));
  return *middle / kDepthUnitsPerMetre;
}

}  // namespace comap
