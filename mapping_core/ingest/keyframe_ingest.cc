#include "mapping_core/ingest/keyframe_ingest.h"

#include "protocol/codec/keyframe_codec.h"

namespace comap {

Result<KeyframeIngest::Arrival> KeyframeIngest::ingest(std::span<const uint8_t> encoded) {
  const auto keyframe = decodeKeyframe(encoded);  // all of it: what is stored must be readable later
  if (!keyframe) return keyframe.error();
  const auto added = store_.addKeyframe(keyframe->id, keyframe->stamp_ns, encoded);
  if (!added) return added.error();
  const Arrival arrival{keyframe->id, *added};
  if (arrival.is_new) arrived(arrival.id, {});
  return arrival;
}

void KeyframeIngest::arrived(const KeyframeId& id, const std::set<KeyframeId>& mapped) {
  Session& session = sessions_[{id.robot, id.session}];
  session.early.insert(id.sequence);
  while (!session.early.empty() && *session.early.begin() == session.next) {
    session.early.erase(session.early.begin());
    KeyframeId ready{id.robot, id.session, session.next++};
    if (!mapped.contains(ready)) ready_.push_back(std::move(ready));
  }
}

void KeyframeIngest::resume(std::span<const StoredKeyframe> keyframes) {
  std::set<KeyframeId> mapped;
  for (const StoredKeyframe& keyframe : keyframes)
    if (!keyframe.map.empty()) mapped.insert(keyframe.id);
  for (const StoredKeyframe& keyframe : keyframes) arrived(keyframe.id, mapped);
}

KeyframeId KeyframeIngest::takeNext() {
  KeyframeId id = std::move(ready_.front());
  ready_.pop_front();
  return id;
}

size_t KeyframeIngest::waiting() const {
  size_t count = ready_.size();
  for (const auto& [key, session] : sessions_) count += session.early.size();
  return count;
}

}  // namespace comap
