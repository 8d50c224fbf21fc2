// Full-rate trajectories in the joint map: each frame moves with the keyframe it was tracked against.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "edge_agent/agent_report.h"
#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "mapping_core/store/map_store.h"

namespace comap {

/// Of each keyframe the odometry edge to the one after it. A keyframe may have another one, to where a lost robot found
/// back to it much later: no frames lie along that.
std::map<KeyframeId, Edge> odometryToNext(std::span<const Edge> edges);

/// Poses of a robot's frames in `map`. The correction of the graph is interpolated between a keyframe and the next;
/// frames whose keyframe is in another map are left out.
/// `odometry_from`: see odometryToNext().
std::vector<StampedPose> composeTrajectory(const AgentReport& report, const MapId& map,
                                           const std::map<KeyframeId, StoredKeyframe>& keyframes,
                                           const std::map<KeyframeId, Edge>& odometry_from);

/// Writes TUM format: `stamp tx ty tz qx qy qz qw`.
Result<void> writeTrajectory(const std::string& path, const std::vector<StampedPose>& poses);

}  // namespace comap
