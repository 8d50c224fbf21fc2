// How a robot's camera is carried through a scene.
#pragma once

#include <vector>

#include "fleet_tools/synth/scene.h"
#include "protocol/types/pose.h"

namespace comap {

inline constexpr double kSynthRate_hz = 30;

/// Poses (T_world_cam; camera x right, y down, z forward) at 30 Hz along a route: a cubic B-spline guided by the way
/// points, walked at about 0.45 m/s and slower where it turns (below 45 deg/s), with the small sway and wobble of a
/// hand. The route is a circle: more frames walk on, and come by again.
///
/// Robots of one chain start one gap apart: 77 % of what `frames` walk, at most of 200 frames. So each robot's last
/// frames (46 of 200) see what the next one saw in its first, whatever the number of frames.
std::vector<Pose> walkRoute(const Route& route, int frames, uint64_t robot_seed);

}  // namespace comap
