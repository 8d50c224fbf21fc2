#include "edge_agent/uplink/make_room.h"

#include <algorithm>
#include <limits>

#include "protocol/codec/limits.h"

namespace comap {
namespace {

constexpr size_t kThinnedAtOnce = 4;  // each some 20 ms of a robot's processor
constexpr size_t kDroppedAtOnce = 8;
constexpr size_t kStretch = 2000;

// In the units in which keyframes are chosen: one is about the distance between two of them.
double motion(const Pose& T) { return T.translation().norm() / 0.1 + T.angle() / 0.14; }

struct Candidate {
  OutboxKey key;
  double cost = std::numeric_limits<double>::max();
};

// What remains of a row in the search, a small part of it.
struct Place {
  OutboxKey key;
  bool sent;
  bool linked;
  uint32_t linked_to, skipped;
  Pose T_odom_cam, T_link_this;
};

// A stretch of the outbox from `cursor` on, which moves to its end: the whole of a long one would take too long.
Result<std::vector<Place>> nextStretch(Outbox& outbox, OutboxKey& cursor) {
  std::vector<Place> places;
  for (const uint64_t session : outbox.sessions()) {
    if (session < cursor.session) continue;
    const uint32_t from = session == cursor.session ? cursor.sequence : 0;
    const auto rows = outbox.rows(session, from, kStretch - places.size());
    if (!rows) return rows.error();
    for (const OutboxRow& row : *rows)
      places.push_back(
          {row.key, row.sent, row.link.linked, row.link.linked_to, row.skipped, row.T_odom_cam, row.link.T_link_this});
    if (places.size() < kStretch) continue;
    cursor = {session, places.back().key.sequence};
    return places;
  }
  cursor = {};
  return places;
}

// Cheapest first.
Result<std::vector<Candidate>> findDroppable(Outbox& outbox, OutboxKey& cursor) {
  const auto places = nextStretch(outbox, cursor);
  if (!places) return places.error();
  std::map<OutboxKey, const Place*> by_key;
  for (const Place& place : *places) by_key[place.key] = &place;
  std::map<OutboxKey, double> longest;  // motion of the link that takes over, over all that hang on a keyframe
  for (const Place& place : *places) {
    const auto base = by_key.find({place.key.session, place.linked_to});
    if (!place.linked || base == by_key.end()) continue;
    double& most = longest[base->first];
    most = std::max(most, motion(base->second->T_link_this * place.T_link_this));
  }
  std::vector<Candidate> found;
  for (size_t i = 0; i + 1 < places->size(); ++i) {
    const Place& place = (*places)[i];
    const Place& next = (*places)[i + 1];
    // A successor has to say that it is missing, and what the core may hold already stays as it is.
    if (place.sent || next.sent || next.key.session != place.key.session) continue;
    if (place.skipped + next.skipped >= kMaxSkipped) continue;
    if (!place.linked) {
      const auto hanging = outbox.linkedTo(place.key);
      if (!hanging) return hanging.error();
      if (!hanging->empty()) continue;  // a chain's first
    }
    const auto most = longest.find(place.key);
    found.push_back({place.key, most != longest.end() ? most->second : motion(place.T_link_this)});
  }
  std::stable_sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  return found;
}

Result<void> relink(Outbox& outbox, OutboxRow row) {
  const auto encoded = outbox.encoded(row.key);
  if (!encoded) return encoded.error();
  const auto relinked = relinkKeyframe(*encoded, row.link, row.skipped);
  if (!relinked) return relinked.error();
  return outbox.replace(row, *relinked);
}

// As one transaction: takes it out, ties what hung on it to what it hung on, and tells its successor.
Result<OutboxRow> drop(Outbox& outbox, const OutboxKey& key) {
  auto change = outbox.begin();
  if (!change) return change.error();
  const auto found = outbox.firstFrom(key.session, key.sequence);
  if (!found) return found.error();
  const OutboxRow gone = **found;
  if (auto removed = outbox.remove(key); !removed) return removed.error();
  const auto successor = outbox.firstFrom(key.session, key.sequence + 1);
  if (!successor) return successor.error();
  auto changed = outbox.linkedTo(key);
  if (!changed) return changed.error();
  for (OutboxRow& row : *changed) row.link = joinLinks(gone.link, row.link);
  if (changed->empty() || changed->front().key != (*successor)->key) changed->insert(changed->begin(), **successor);
  changed->front().skipped += gone.skipped + 1;
  for (const OutboxRow& row : *changed)
    if (auto done = relink(outbox, row); !done) return done.error();
  if (auto committed = change->commit(); !committed) return committed.error();
  return gone;
}

Result<bool> thinOldest(Outbox& outbox, int quality) {
  const auto oldest = outbox.oldestUnthinned();
  if (!oldest) return oldest.error();
  if (!*oldest) return false;
  OutboxRow row = **oldest;
  row.thinned = true;
  const auto encoded = outbox.encoded(row.key);
  if (!encoded) return encoded.error();
  const auto thinner = thinColour(*encoded, quality);
  if (!thinner) return thinner.error();
  if (auto replaced = outbox.replace(row, *thinner); !replaced) return replaced.error();
  return true;
}

}  // namespace

Result<RoomMade> makeRoom(Outbox& outbox, uint64_t quota_bytes, int thin_quality, OutboxKey& cursor) {
  RoomMade made;
  while (outbox.bytes() > quota_bytes && made.thinned < kThinnedAtOnce) {
    const auto thinned = thinOldest(outbox, thin_quality);
    if (!thinned) return thinned.error();
    if (!*thinned) break;
    ++made.thinned;
  }
  if (outbox.bytes() <= quota_bytes || made.thinned == kThinnedAtOnce) return made;
  const auto candidates = findDroppable(outbox, cursor);
  if (!candidates) return candidates.error();
  std::vector<OutboxKey> changed;  // their costs are no longer true
  for (const Candidate& candidate : *candidates) {
    if (outbox.bytes() <= quota_bytes || made.dropped.size() == kDroppedAtOnce) return made;
    const auto near = [&](const OutboxKey& key) {
      return key.session == candidate.key.session &&
             std::max(key.sequence, candidate.key.sequence) - std::min(key.sequence, candidate.key.sequence) < 8;
    };
    if (std::any_of(changed.begin(), changed.end(), near)) continue;
    auto gone = drop(outbox, candidate.key);
    if (!gone) return gone.error();
    changed.push_back(candidate.key);
    made.dropped.push_back(std::move(*gone));
  }
  made.enough = outbox.bytes() <= quota_bytes || !made.dropped.empty() || cursor != OutboxKey();
  return made;
}

}  // namespace comap
