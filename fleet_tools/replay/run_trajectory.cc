#include "fleet_tools/replay/run_trajectory.h"

#include <spdlog/fmt/fmt.h>

#include "edge_agent/capture/stamp.h"
#include "protocol/types/whole_file.h"

namespace comap {

std::map<KeyframeId, Edge> odometryToNext(std::span<const Edge> edges) {
  std::map<KeyframeId, Edge> from;
  for (const Edge& edge : edges)
    if (edge.kind == EdgeKind::kOdometry && edge.to.sequence == edge.from.sequence + 1) from[edge.from] = edge;
  return from;
}

std::vector<StampedPose> composeTrajectory(const AgentReport& report, const MapId& map,
                                           const std::map<KeyframeId, StoredKeyframe>& keyframes,
                                           const std::map<KeyframeId, Edge>& odometry_from) {
  std::vector<StampedPose> poses;
  const auto& frames = report.trajectory;
  size_t window_end = 0;  // first frame of the next keyframe
  size_t window_start = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (i >= window_end) {
      window_start = i;
      window_end = i + 1;
      while (window_end < frames.size() && frames[window_end].keyframe == frames[i].keyframe) ++window_end;
    }
    const KeyframeId id{report.robot, report.session, frames[i].keyframe};
    const auto keyframe = keyframes.find(id);
    if (keyframe == keyframes.end() || keyframe->second.map != map) continue;
    Pose T_keyframe_cam = frames[i].T_keyframe_cam;
    const auto edge = odometry_from.find(id);
    if (edge != odometry_from.end()) {
      const Pose T_this_next = keyframe->second.T_map_cam.inverse() * keyframes.at(edge->second.to).T_map_cam;
      const Pose correction = T_this_next * edge->second.T_from_to.inverse();
      const double share = static_cast<double>(i - window_start) / static_cast<double>(window_end - window_start);
      T_keyframe_cam = interpolate(Pose(), correction, share) * T_keyframe_cam;
    }
    poses.push_back({frames[i].stamp_ns, keyframe->second.T_map_cam * T_keyframe_cam});
  }
  return poses;
}

Result<void> writeTrajectory(const std::string& path, const std::vector<StampedPose>& poses) {
  std::string text;
  for (const StampedPose& pose : poses) {
    const auto& t = pose.pose.translation();
    const auto& q = pose.pose.rotation();
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", formatStamp(pose.stamp_ns), t.x(),
                        t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return writeWholeFile(path, text);
}

}  // namespace comap
