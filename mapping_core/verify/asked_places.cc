#include "mapping_core/verify/asked_places.h"

#include <utility>

namespace comap {

bool AskedPlaces::samePlace(const Pose& T_map_a, const Pose& T_map_b) const {
  const Pose between = T_map_a.inverse() * T_map_b;
  return between.translation().norm() < options_.same_m && between.angle() < options_.same_rad;
}

std::vector<KeyframeId> AskedPlaces::refusedBefore(const Keyframe& keyframe,
                                                   const std::map<KeyframeId, Pose>& T_map_cam) const {
  const auto last = last_.find(keyframe.id.robot);
  const KeyframeId linked_to{keyframe.id.robot, keyframe.id.session, keyframe.linked_to};
  const bool before =
      last != last_.end() && keyframe.linked && last->second.id == linked_to && samePlace(Pose(), keyframe.T_link_this);
  if (!before) return {};
  std::vector<KeyframeId> refused;
  for (const KeyframeId& id : last->second.refused)
    if (T_map_cam.contains(id)) refused.push_back(id);
  return refused;
}

void AskedPlaces::note(const KeyframeId& query, std::vector<KeyframeId> refused) {
  last_[query.robot] = {query, std::move(refused)};
}

}  // namespace comap
