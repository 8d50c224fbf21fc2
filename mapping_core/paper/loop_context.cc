#include "mapping_core/paper/loop_context.h"

namespace comap {

void LoopContext::movePoses(const DeformationGraph& graph, bool logs) const {
  for (FernPlace& place : frame.ferns.places()) place.T_map_cam = graph.move(place.T_map_cam, place.time);
  if (!logs) return;
  for (PaperCamera& one : cameras) {
    if (one.frame != camera.frame) continue;
    for (LoggedPose& pose : one.log) pose.T_map_cam = graph.move(pose.T_map_cam, {one.index, pose.tick});
    if (one.index != camera.index) one.T_map_cam = graph.move(one.T_map_cam, {one.index, tick});
  }
}

}  // namespace comap
