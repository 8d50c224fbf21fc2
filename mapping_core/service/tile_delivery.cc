#include "mapping_core/service/tile_delivery.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/codec/codec.h"
#include "protocol/telemetry/stage_clock.h"
#include "protocol/types/tile_hash.h"

namespace comap {
namespace {

constexpr size_t kMostEncodedBytes = 32 << 20;  // kept for further robots
constexpr size_t kInterestsPerSecond = 2;       // share of the per-second budget that one interest may use

using Json = nlohmann::json;

// For traces: when tiles changed, and what left.
void noteRenewed(const TileIndex& index, const MapId& map, size_t changed) {
  if (!StageClock::process().traces()) return;
  const std::vector<Tile> tiles = index.tiles(map);
  Json keys = Json::array();
  if (changed > 0)
    for (const Tile& tile : tiles)
      if (tile.revision == index.revision()) keys.push_back({tile.key.x, tile.key.y, tile.key.z});
  StageClock::process().note(
      "renewed",
      Json{{"map", map}, {"revision", index.revision()}, {"tiles", keys}, {"hash", hashTiles(tiles)}}.dump());
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
  TileDownlink& downlink = downlinks_[interest.robot];
  return send(interest, at, downlink, downlink.reported(at.map, interest.held, TileDownlink::Clock::now()));
}

Result<void> TileDelivery::answerObserver(const Interest& interest) {
  constexpr size_t kMostAsked = 128;  // observers times maps
  constexpr std::chrono::seconds kGone(30);
  const auto now = std::chrono::steady_clock::now();
  std::erase_if(observers_, [&](const auto& entry) {
    return !index_.holds(entry.first.second) || now - entry.second.asked > kGone;
  });
  if (!interest.at || !index_.holds(interest.at->map)) return {};
  const std::pair asked(interest.robot, interest.at->map);
  if (!observers_.contains(asked) && observers_.size() >= kMostAsked) return {};
  Observer& observer = observers_[asked];
  observer.asked = now;
  return send(interest, *interest.at, observer.downlink,
              observer.downlink.reported(interest.at->map, interest.held, now));
}

Result<void> TileDelivery::renew(const MapId& map, std::vector<Tile> tiles, const RobotRegistry& robots) {
  const size_t changed = index_.update(map, std::move(tiles));
  noteRenewed(index_, map, changed);
  return paced_ ? push(map, robots) : Result<void>();
}

// A robot may know better where it is than the graph does yet: in a part of the joint map that it has recognised.
MapPose TileDelivery::wantedAt(const Interest& interest, const Correction& correction) const {
  if (interest.at && index_.holds(interest.at->map)) return *interest.at;
  return {correction.map, correction.T_map_odom * interest.T_odom_cam};
}

// Robots that have asked lately need not ask again for what has changed since.
Result<void> TileDelivery::push(const MapId& map, const RobotRegistry& robots) {
  const auto now = std::chrono::steady_clock::now();
  for (const auto& [robot, record] : robots.robots()) {
    if (!record.interest || !record.correction) continue;
    TileDownlink& downlink = downlinks_[robot];
    const MapPose at = wantedAt(*record.interest, *record.correction);
    if (at.map != map || !downlink.fresh(map, now)) continue;
    if (auto sent = send(*record.interest, at, downlink, downlink.held()); !sent) return sent;
  }
  return {};
}

Result<void> TileDelivery::send(const Interest& interest, const MapPose& at, TileDownlink& downlink,
                                std::span<const HeldTile> held) {
  const auto now = std::chrono::steady_clock::now();
  const size_t per_second = interest.budget_bytes_per_s;
  size_t budget = per_second / kInterestsPerSecond;
  if (paced_) budget = std::min(downlink.allowance(per_second, now), downlink.room());
  if (budget == 0) return {};
  bool first = true;
  const auto mayGo = [&](size_t bytes) {
    if (!paced_) return true;
    const size_t allowed = downlink.allowance(per_second, now);
    if (bytes + TileDownlink::kEnvelope > allowed && allowed < per_second) return false;
    return first || bytes <= downlink.room();
  };
  const size_t guess = paced_ ? 2 * budget : budget;  // packed, tiles are smaller than their index says
  for (const Tile& tile : index_.lacking(at.map, at.T_map_cam, interest.radius_m, held, guess)) {
    const auto encoded = encodedOf(tile);
    if (!encoded) return encoded.error();
    if (!mayGo(encoded->size())) break;
    if (!link_.publish(Topic::kTile, interest.robot, *encoded)) break;  // no room: with the next interest
    first = false;
    sent_bytes_[interest.robot] += encoded->size();
    downlink.sent(tile.key, tile.revision, encoded->size(), now, tile.empty());
    noteSent(interest.robot, encoded->size());
  }
  return {};
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
