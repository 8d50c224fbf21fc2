#include "fleet_tools/evaluate/keyframe_truth.h"

#include <algorithm>

#include "fleet_tools/evaluate/metrics_trajectory.h"

namespace comap {

Result<std::map<KeyframeId, Pose>> keyframeTruth(const std::vector<StoredKeyframe>& keyframes,
                                                 const std::map<std::string, std::string>& truths) {
  std::map<std::string, std::vector<StampedPose>> estimates;  // keyframes as a trajectory, to be paired by time
  std::map<std::pair<std::string, int64_t>, KeyframeId> by_stamp;
  for (const StoredKeyframe& keyframe : keyframes) {
    estimates[keyframe.id.robot].push_back({keyframe.stamp_ns, keyframe.T_map_cam});
    by_stamp[{keyframe.id.robot, keyframe.stamp_ns}] = keyframe.id;
  }
  std::map<KeyframeId, Pose> T_truth_cam;
  for (const auto& [robot, file] : truths) {
    const auto reference = readTrajectory(file);
    if (!reference) return reference.error();
    auto& own = estimates[robot];
    std::sort(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
    for (const PosePair& pair : associate(own, *reference))
      T_truth_cam[by_stamp.at({robot, pair.estimate.stamp_ns})] = pair.truth.pose;
  }
  return T_truth_cam;
}

}  // namespace comap
