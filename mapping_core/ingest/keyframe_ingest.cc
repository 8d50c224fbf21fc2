#include "mapping_core/ingest/keyframe_ingest.h"

#include "protocol/codec/keyframe_codec.h"

namespace comap {

Result<KeyframeIngest::Arrival> KeyframeIngest::ingest(std::span<const uint8_t> encoded) {
  const auto keyframe = decodeKeyframe(encoded);  // all of it: what is stored must be readable later
  if (!keyframe) return keyframe.error();
  const auto added = store_.addKeyframe(keyframe->id, keyframe->stamp_ns, encoded);
  if (!added) return added.error();
  const Arrival arrival{keyframe->id, *added};
  if (!arrival.is_new) return arrival;
  Session& session = sessions_[{arrival.id.robot, arrival.id.session}];
  session.early.insert(arrival.id.sequence);
  while (!session.early.empty() && *session.early.begin() == session.next) {
    session.early.erase(session.early.begin());
    ready_.push_back({arrival.id.robot, arrival.id.session, session.next++});
  }
  return arrival;
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
