#include "mapping_core/store/keyframe_places.h"

#include <algorithm>

namespace comap {

KeyframePlaces::KeyframePlaces(const std::vector<WholeKeyframe>& keyframes) {
  auto into = sessions_.end();
  for (size_t i = 0; i < keyframes.size(); ++i) {
    const KeyframeId& id = keyframes[i].stored.id;
    if (into == sessions_.end() || into->first.second != id.session || into->first.first != id.robot)
      into = sessions_.try_emplace({id.robot, id.session}).first;
    into->second.push_back({id.sequence, static_cast<uint32_t>(i)});
  }
  for (auto& [session, places] : sessions_)
    if (!std::is_sorted(places.begin(), places.end())) std::sort(places.begin(), places.end());
}

std::optional<uint32_t> KeyframePlaces::placeOf(const KeyframeId& id) const {
  if (last_ == sessions_.end() || last_->first.second != id.session || last_->first.first != id.robot)
    last_ = sessions_.find({id.robot, id.session});
  if (last_ == sessions_.end()) return std::nullopt;
  const Places& places = last_->second;
  // In a session without gaps, it is there.
  const size_t guess = size_t{id.sequence} - places.front().sequence;
  if (id.sequence >= places.front().sequence && guess < places.size() && places[guess].sequence == id.sequence)
    return places[guess].place;
  const auto found = std::lower_bound(places.begin(), places.end(), Place{id.sequence, 0});
  return found != places.end() && found->sequence == id.sequence ? std::optional(found->place) : std::nullopt;
}

}  // namespace comap
