#include "mapping_core/paper/merge_frames.h"

#include <algorithm>

namespace comap {

Result<void> mergeFrames(ReferenceFrame& kept, size_t kept_index, ReferenceFrame& absorbed, size_t absorbed_index,
                         const Pose& T_kept_absorbed, std::vector<PaperCamera>& cameras, uint32_t tick) {
  const Eigen::Matrix3f R = T_kept_absorbed.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_kept_absorbed.translation().cast<float>();
  auto moved = absorbed.map.rewrite([&](TimedSurfel& surfel) {
    surfel.surfel.position = R * surfel.surfel.position + t;
    surfel.surfel.normal = R * surfel.surfel.normal;
  });
  if (!moved) return moved;
  kept.map.absorb(std::move(absorbed.map));
  kept.ferns.absorb(std::move(absorbed.ferns), T_kept_absorbed);
  for (Tie& tie : absorbed.ties) {
    tie.source = T_kept_absorbed * tie.source;
    tie.target = T_kept_absorbed * tie.target;
    kept.ties.push_back(tie);
  }
  absorbed.ties.clear();
  kept.merged_at = tick;
  kept.deformed_at = std::max(kept.deformed_at, absorbed.deformed_at);
  for (PaperCamera& camera : cameras) {
    if (camera.frame != absorbed_index) continue;
    camera.frame = kept_index;
    camera.T_map_cam = T_kept_absorbed * camera.T_map_cam;
    for (LoggedPose& pose : camera.log) pose.T_map_cam = T_kept_absorbed * pose.T_map_cam;
  }
  return {};
}

}  // namespace comap
