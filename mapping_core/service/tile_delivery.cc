#include "mapping_core/service/tile_delivery.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "mapping_core/tiles/coarse_tile.h"
#include "protocol/codec/codec.h"
#include "protocol/telemetry/stage_clock.h"
#include "protocol/types/tile_hash.h"
#include "protocol/types/tile_revision.h"

namespace comap {
namespace {

constexpr size_t kMostEncodedBytes = 32 << 20;       // kept for further robots
constexpr size_t kInterestsPerSecond = 2;            // share of the per-second budget that one interest may use
constexpr double kSoon_s = 0.25;                     // of its budget a robot gets without coarse forms
constexpr std::chrono::milliseconds kUntilRoom(20);  // that the link is left alone when it takes no more

using Json = nlohmann::json;

// For traces: when tiles changed, and what left.
void noteRenewed(const TileIndex& index, const MapId& map, size_t changed) {
  if (!StageClock::process().traces()) return;
  Json keys = Json::array();
  for (const auto& [key, tile] : index.of(map))
    if (changed > 0 && !tile.empty() && tile.revision == index.revision()) keys.push_back({key.x, key.y, key.z});
  StageClock::process().note("renewed", Json{{"map", map}, {"revision", index.revision()}, {"tiles", keys}}.dump());
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
  planRobot(interest, at, to.downlink.reported(at.map, interest.held, Clock::now()), to);
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

void TileDelivery::noteHashes() {
  if (!StageClock::process().traces() || hashed_ == index_.revision()) return;
  hashed_ = index_.revision();
  std::map<MapId, TileHash> hashes;
  for (const auto& [key, tile] : index_.all())
    if (!tile.empty()) hashes[key.map].add(tile);
  for (const auto& [map, hash] : hashes)
    StageClock::process().note("tiles hash", Json{{"map", map}, {"hash", hash.value()}}.dump());
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

// What would take a robot's link a good while goes roughly first: after a merge it has all of the joint map at once.
void TileDelivery::planRobot(const Interest& interest, const MapPose& at, std::span<const HeldTile> held,
                             Receiver& to) const {
  plan(interest, at, held, to);
  if (!paced_) return;
  size_t bytes = 0;
  for (const TileDue& due : to.due)
    if (const Tile* tile = due.removal ? nullptr : index_.find(due.key)) bytes += roughBytes(*tile);
  const auto soon = static_cast<size_t>(kSoon_s * interest.budget_bytes_per_s);
  if (bytes > std::min(soon, to.downlink.room())) to.due = withCoarse(index_, std::move(to.due), held);
}

// Robots that have asked lately need not ask again for what has changed since.
Result<void> TileDelivery::push(const MapId& map, const RobotRegistry& robots) {
  const auto now = Clock::now();
  for (const auto& [robot, record] : robots.robots()) {
    if (!record.interest || !record.correction) continue;
    Receiver& to = receivers_[robot];
    const MapPose at = wantedAt(*record.interest, *record.correction);
    if (at.map != map || !to.downlink.fresh(map, now)) continue;
    planRobot(*record.interest, at, to.downlink.held(), to);
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
    if ((tile == nullptr) != due.removal) continue;
    if (tile != nullptr && (due.coarse ? coarseRevision(tile->revision) : tile->revision) != due.revision) continue;
    const Tile removal{due.key, due.revision};
    const auto encoded = encodedOf(tile != nullptr ? *tile : removal, due.coarse);
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

Result<std::span<const uint8_t>> TileDelivery::encodedOf(const Tile& tile, bool coarse) {
  const std::pair place(tile.key, coarse);
  if (const auto kept = encoded_.find(place); kept != encoded_.end() && kept->second.revision == tile.revision)
    return std::span<const uint8_t>(kept->second.bytes);
  auto bytes = encodeTile(coarse ? coarsened(tile) : tile);
  if (!bytes) return bytes.error();
  if (encoded_bytes_ + bytes->size() > kMostEncodedBytes) {
    encoded_.clear();
    encoded_bytes_ = 0;
  }
  Encoded& kept = encoded_[place];
  encoded_bytes_ += bytes->size() - kept.bytes.size();
  kept = {tile.revision, std::move(*bytes)};
  return std::span<const uint8_t>(kept.bytes);
}

}  // namespace comap
