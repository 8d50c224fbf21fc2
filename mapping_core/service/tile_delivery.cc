#include "mapping_core/service/tile_delivery.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/codec/codec.h"
#include "protocol/telemetry/stage_clock.h"
#include "protocol/types/tile_hash.h"

namespace comap {
namespace {

constexpr size_t kMostEncodedBytes = 32 << 20;       // kept for further robots
constexpr size_t kInterestsPerSecond = 2;            // share of the per-second budget that one interest may use
constexpr std::chrono::milliseconds kUntilRoom(20);  // that the link is left alone when it takes no more

using Json = nlohmann::json;

// For traces: when tiles changed, and what left.
void noteRenewed(const TileIndex& index, const MapId& map, size_t changed) {
  if (!StageClock::process().traces()) return;
  Json keys = Json::array();
  TileHash hash;
  for (const auto& [key, tile] : index.of(map)) {
    if (tile.empty()) continue;
    hash.add(tile);
    if (changed > 0 && tile.revision == index.revision()) keys.push_back({key.x, key.y, key.z});
  }
  StageClock::process().note(
      "renewed", Json{{"map", map}, {"revision", index.revision()}, {"tiles", keys}, {"hash", hash.value()}}.dump());
}

void noteSent(const std::string& robot, size_t bytes) {
  if (StageClock::process().traces())
    StageClock::process().note("tile sent", Json{{"robot", robot}, {"bytes", bytes}}.dump());
}

}  // namespace

Result<void> TileDelivery::answer(RobotRecord& record, const Interest& interest) {
  if (!record.correction) return {};
  record.interest = interest;
  const MapPose at = wantedAt(interest, *record.correction);
  Receiver& to = receivers_[interest.robot];
  plan(interest, at, to.downlink.reported(at.map, interest.held, Clock::now()), to);
  return send(interest, to);
}

Result<void> TileDelivery::answerObserver(const Interest& interest) {
  constexpr size_t kMostAsked = 128;  // observers times maps
  constexpr std::chrono::seconds kGone(30);
  const auto now = Clock::now();
  std::erase_if(observers_, [&](const auto& entry) {
    return !index_.holds(entry.first.second) || now - entry.second.asked > kGone;
  });
  if (!interest.at || !index_.holds(interest.at->map)) return {};
  const std::pair asked(interest.robot, interest.at->map);
  if (!observers_.contains(asked) && observers_.size() >= kMostAsked) return {};
  Observer& observer = observers_[asked];
  observer.asked = now;
  Receiver& to = observer.receiver;
  plan(interest, *interest.at, to.downlink.reported(interest.at->map, interest.held, now), to);
  return send(interest, to);
}

Result<void> TileDelivery::renew(const MapId& map, std::vector<Tile> changed, const RobotRegistry& robots) {
  noteRenewed(index_, map, index_.change(map, std::move(changed)));
  return paced_ ? push(map, robots) : Result<void>();
}

void TileDelivery::drop(const MapId& map) {
  index_.drop(map);
  for (auto& [robot, to] : receivers_)
    if (to.hasDue() && to.due[to.next].key.map == map) to.due.clear();
}

// A robot may know better where it is than the graph does yet: in a part of the joint map that it has recognised.
MapPose TileDelivery::wantedAt(const Interest& interest, const Correction& correction) const {
  if (interest.at && index_.holds(interest.at->map)) return *interest.at;
  return {correction.map, correction.T_map_odom * interest.T_odom_cam};
}

void TileDelivery::plan(const Interest& interest, const MapPose& at, std::span<const HeldTile> held,
                        Receiver& to) const {
  to.due = index_.lacking(at.map, at.T_map_cam, interest.radius_m, held);
  to.next = 0;
}

// Robots that have asked lately need not ask again for what has changed since.
Result<void> TileDelivery::push(const MapId& map, const RobotRegistry& robots) {
  const auto now = Clock::now();
  for (const auto& [robot, record] : robots.robots()) {
    if (!record.interest || !record.correction) continue;
    Receiver& to = receivers_[robot];
    const MapPose at = wantedAt(*record.interest, *record.correction);
    if (at.map != map || !to.downlink.fresh(map, now)) continue;
    plan(*record.interest, at, to.downlink.held(), to);
    if (auto sent = send(*record.interest, to); !sent) return sent;
  }
  return {};
}

bool TileDelivery::unfinished() const {
  return paced_ &&
         std::any_of(receivers_.begin(), receivers_.end(), [](const auto& one) { return one.second.hasDue(); });
}

Result<void> TileDelivery::goOn(const RobotRegistry& robots) {
  if (!paced_) return {};
  const auto now = Clock::now();
  for (auto& [robot, to] : receivers_) {
    if (!to.hasDue()) continue;
    const auto record = robots.robots().find(robot);
    const bool asks =
        record != robots.robots().end() && record->second.interest && to.downlink.fresh(to.due[to.next].key.map, now);
    if (!asks) {
      to.due.clear();  // its next interest says what it lacks
    } else if (auto sent = send(*record->second.interest, to); !sent) {
      return sent;
    }
  }
  return {};
}

Result<void> TileDelivery::send(const Interest& interest, Receiver& to) {
  if (interest.budget_bytes_per_s == 0) return {};
  const auto now = Clock::now();
  if (paced_ && (now < to.full_until || to.downlink.room() == 0)) return {};
  size_t sent = 0;
  for (; to.hasDue(); ++to.next) {
    const TileDue& due = to.due[to.next];
    const Tile* tile = index_.find(due.key);
    if ((tile == nullptr) != due.removal || (tile != nullptr && tile->revision != due.revision)) continue;
    const Tile removal{due.key, due.revision};
    const auto encoded = encodedOf(tile != nullptr ? *tile : removal);
    if (!encoded) return encoded.error();
    if (!mayGo(interest, to, encoded->size(), sent)) break;
    if (!link_.publish(Topic::kTile, interest.robot, *encoded)) {
      to.full_until = now + kUntilRoom;
      break;
    }
    sent += encoded->size();
    sent_bytes_[interest.robot] += encoded->size();
    // By now: all of these may take a while, and what counts as older is forgotten sooner.
    to.downlink.sent(due.key, due.revision, encoded->size(), Clock::now(), due.removal);
    noteSent(interest.robot, encoded->size());
  }
  return {};
}

// One tile goes whatever its size, if anything may.
bool TileDelivery::mayGo(const Interest& interest, Receiver& to, size_t bytes, size_t sent) const {
  const size_t per_second = interest.budget_bytes_per_s;
  if (!paced_) return sent == 0 || sent + bytes <= per_second / kInterestsPerSecond;
  const size_t allowed = to.downlink.allowance(per_second, Clock::now());
  if (bytes + TileDownlink::kEnvelope > allowed && allowed < per_second) return false;
  return sent == 0 || bytes <= to.downlink.room();
}

Result<std::span<const uint8_t>> TileDelivery::encodedOf(const Tile& tile) {
  if (const auto kept = encoded_.find(tile.key); kept != encoded_.end() && kept->second.revision == tile.revision)
    return std::span<const uint8_t>(kept->second.bytes);
  auto bytes = encodeTile(tile);
  if (!bytes) return bytes.error();
  if (encoded_bytes_ + bytes->size() > kMostEncodedBytes) {
    encoded_.clear();
    encoded_bytes_ = 0;
  }
  Encoded& place = encoded_[tile.key];
  encoded_bytes_ += bytes->size() - place.bytes.size();
  place = {tile.revision, std::move(*bytes)};
  return std::span<const uint8_t>(place.bytes);
}

}  // namespace comap
