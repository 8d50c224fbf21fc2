// When a frame becomes a keyframe.
#pragma once

#include <string_view>

#include "edge_agent/odometry/visual_odometry.h"

namespace comap {

struct KeyframeOptions {
  double translation_m = 0.10;  ///< at 2 m median depth; scaled with it
  double rotation_rad = 0.14;   ///< 8 degrees
  double overlap = 0.75;        ///< share of the keyframe's points still in view
  int max_frames = 30;          ///< at the latest
};

/// Why `tracked` should become a keyframe; empty if it should not.
/// `frames_since`: frames tracked since the last keyframe; `median_depth_m` of the frame.
std::string_view keyframeReason(const TrackedFrame& tracked, int frames_since, double median_depth_m,
                                const KeyframeOptions& options);

/// Median of the valid depths, metres; 0 if there are none. From at most 4800 pixels on a grid.
double medianDepth(const DepthImage& depth);

}  // namespace comap
