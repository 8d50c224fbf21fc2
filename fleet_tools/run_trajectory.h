// Full-rate trajectories in the joint map: each frame moves with the keyframe it was tracked against.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "edge_agent/agent_report.h"
#include "mapping_core/store/map_store.h"

namespace comap {

struct StampedPose {
  int64_t stamp_ns = 0;
  Pose T_map_cam;
};

/// Poses of a robot's frames in `map`. The correction of the graph is interpolated between a keyframe and the next;
/// frames whose keyframe is in another map are left out.
std::vector<StampedPose> composeTrajectory(const AgentReport& report, const MapId& map,
                                           const std::map<KeyframeId, StoredKeyframe>& keyframes,
                                           const std::map<KeyframeId, Edge>& odometry_from);

/// Writes TUM format: `stamp tx ty tz qx qy qz qw`.
Result<void> writeTrajectory(const std::string& path, const std::vector<StampedPose>& poses);

}  // namespace comap
