#include "mapping_core/ingest/keyframe_ingest.h"

#include <algorithm>
#include <utility>

#include "protocol/codec/keyframe_codec.h"

namespace comap {

namespace {

constexpr size_t kMostDecoded = 32;  // some 50 MB of usual pictures

std::vector<KeyframeId> rightBefore(const KeyframeId& id, uint32_t count) {
  std::vector<KeyframeId> ids;
  for (uint32_t sequence = id.sequence - count; sequence < id.sequence; ++sequence)
    ids.push_back({id.robot, id.session, sequence});
  return ids;
}

}  // namespace

Result<KeyframeIngest::Arrival> KeyframeIngest::ingest(std::span<const uint8_t> encoded) {
  auto keyframe = decodeKeyframe(encoded);  // all of it: what is stored must be readable later
  if (!keyframe) return keyframe.error();
  const auto added = store_.addKeyframe(keyframe->id, keyframe->stamp_ns, encoded);
  if (!added) {  // not the keyframe's fault, whatever it is
    const bool damaged = added.error().code == ErrorCode::kBadData;
    return Error{damaged ? ErrorCode::kUnreachable : added.error().code, added.error().text};
  }
  Arrival arrival{keyframe->id, *added, rightBefore(keyframe->id, keyframe->skipped)};
  if (arrival.is_new) {
    arrived(arrival.id, keyframe->skipped, {});
    decoded_.emplace(arrival.id, std::move(*keyframe));
    decoded_order_.push_back(arrival.id);
  }
  if (decoded_order_.size() > kMostDecoded) {
    decoded_.erase(decoded_order_.front());
    decoded_order_.pop_front();
  }
  return arrival;
}

std::optional<Keyframe> KeyframeIngest::takeDecoded(const KeyframeId& id) {
  auto found = decoded_.extract(id);
  if (found.empty()) return std::nullopt;
  return std::move(found.mapped());
}

void KeyframeIngest::arrived(const KeyframeId& id, uint32_t skipped, const std::set<KeyframeId>& mapped) {
  const SessionName name{id.robot, id.session};
  Session& session = sessions_[name];
  if (id.sequence >= session.next)
    session.early.insert(id.sequence);
  else if (session.passed.erase(id.sequence) > 0 && !mapped.contains(id))
    insertLate(id);
  for (uint32_t sequence = std::max(session.next, id.sequence - skipped); sequence < id.sequence; ++sequence)
    session.skipped.insert(sequence);
  advance(name, mapped);
}

// Makes all ready that nothing is missing before.
void KeyframeIngest::advance(const SessionName& name, const std::set<KeyframeId>& mapped) {
  Session& session = sessions_[name];
  for (;; ++session.next) {
    const bool is_there = session.early.erase(session.next) > 0;
    const bool is_skipped = session.skipped.erase(session.next) > 0;
    if (is_there) session.passed.erase(session.next);
    if (!is_there && !is_skipped && !session.passed.contains(session.next)) return;
    KeyframeId ready{name.first, name.second, session.next};
    if (is_there && !mapped.contains(ready)) ready_.push_back(std::move(ready));
  }
}

// Before those of its session that come after it, so that they find it there if they are not mapped yet.
void KeyframeIngest::insertLate(const KeyframeId& id) {
  const auto behind = std::find_if(ready_.begin(), ready_.end(), [&](const KeyframeId& other) {
    return other.robot == id.robot && other.session == id.session && other.sequence > id.sequence;
  });
  ready_.insert(behind, id);
}

bool KeyframeIngest::passOver(const KeyframeId& id, const KeyframeLink& link) {
  const SessionName name{id.robot, id.session};
  Session& session = sessions_[name];
  if (const auto known = session.passed.find(id.sequence); known != session.passed.end()) {
    known->second = link;
    return false;
  }
  if (id.sequence < session.next || session.early.contains(id.sequence) || session.skipped.contains(id.sequence))
    return false;
  session.passed.emplace(id.sequence, link);
  advance(name, {});
  return true;
}

void KeyframeIngest::tieAcrossGaps(Keyframe& keyframe) const {
  const auto session = sessions_.find({keyframe.id.robot, keyframe.id.session});
  if (session == sessions_.end()) return;
  const auto& passed = session->second.passed;
  for (auto gap = passed.find(keyframe.linked_to); keyframe.linked && gap != passed.end();
       gap = passed.find(keyframe.linked_to)) {
    const KeyframeLink joined =
        joinLinks(gap->second, {true, keyframe.linked_to, keyframe.T_link_this, keyframe.information});
    keyframe.linked = joined.linked;
    keyframe.linked_to = joined.linked_to;
    keyframe.T_link_this = joined.T_link_this;
    keyframe.information = joined.information;
  }
}

// What was mapped shows what was gone on without; its robot tells again what it hangs on.
void KeyframeIngest::passOverAsBefore(const std::set<KeyframeId>& mapped) {
  for (const KeyframeId& id : mapped) {
    const SessionName name{id.robot, id.session};
    Session& session = sessions_[name];
    for (uint32_t sequence = session.next; sequence < id.sequence; ++sequence)
      if (!session.early.contains(sequence) && !session.skipped.contains(sequence)) session.passed[sequence];
    advance(name, mapped);
  }
}

Result<std::vector<KeyframeId>> KeyframeIngest::resume(std::span<const StoredKeyframe> keyframes) {
  std::set<KeyframeId> all, mapped;
  for (const StoredKeyframe& keyframe : keyframes) {
    all.insert(keyframe.id);
    if (!keyframe.map.empty()) mapped.insert(keyframe.id);
  }
  std::vector<KeyframeId> never;
  for (const StoredKeyframe& keyframe : keyframes) {
    uint32_t skipped = 0;
    const KeyframeId before{keyframe.id.robot, keyframe.id.session, keyframe.id.sequence - 1};
    if (keyframe.id.sequence > 0 && !all.contains(before)) {  // only then it says why
      const auto encoded = store_.encodedKeyframe(keyframe.id);
      if (!encoded) return encoded.error();
      const auto decoded = decodeKeyframeWithoutImages(*encoded);
      if (!decoded) return decoded.error();
      skipped = decoded->skipped;
      const auto gap = rightBefore(keyframe.id, skipped);
      never.insert(never.end(), gap.begin(), gap.end());
    }
    arrived(keyframe.id, skipped, mapped);
  }
  passOverAsBefore(mapped);
  return never;
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
