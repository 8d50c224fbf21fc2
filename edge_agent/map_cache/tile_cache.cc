#include "edge_agent/map_cache/tile_cache.h"

#include <algorithm>
#include <cmath>

#include "protocol/types/tile_distance.h"
#include "protocol/types/tile_hash.h"

namespace comap {
namespace {

constexpr size_t kBytesPerTile = 256;  // key, map's name, revision, two nodes of trees
constexpr size_t kBytesFromDiskAtOnce = size_t{4} << 20;
constexpr double kRoomAfterForgetting = 0.9, kRoomToGrow = 0.7;  // of the bytes and entries

size_t sizeOf(const Tile& tile) {
  size_t bytes = kBytesPerTile + tile.surfels.capacity() * sizeof(TileSurfel);
  for (const TilePlace& place : tile.places) bytes += sizeof(TilePlace) + place.code.codes.capacity();
  return bytes;
}

}  // namespace

void TileCache::setMap(const MapId& map) {
  if (map == map_) return;
  map_ = map;
  tiles_.clear();
  revisions_.clear();
  bytes_ = surfels_ = 0;
  ++changes_;
  stored_.setMap(map);
  unread_.clear();
  earlier_.clear();
  for (const auto& [key, revision] : stored_.revisions()) earlier_.insert(key);
}

bool TileCache::put(Tile tile, std::span<const uint8_t> encoded) {
  if (tile.key.map != map_) return false;
  const TileKey key = tile.key;
  const auto known = revisions_.find(key);
  const auto on_disk = stored_.revisions().find(key);
  const bool is_known = known != revisions_.end() || on_disk != stored_.revisions().end();
  const uint64_t revision = known != revisions_.end() ? known->second : is_known ? on_disk->second : 0;
  const bool earlier = earlier_.contains(key);
  if (is_known && (earlier ? tile.revision == revision : tile.revision <= revision)) return false;
  earlier_.erase(key);
  unread_.erase(key);
  stored_.put(key, tile.revision, tile.empty() ? std::span<const uint8_t>() : encoded);
  take(std::move(tile));
  return true;
}

void TileCache::take(Tile tile) {
  const TileKey key = tile.key;
  forget(key);
  revisions_[key] = tile.revision;
  bytes_ += kBytesPerTile;
  if (tile.empty()) return;
  bytes_ += sizeOf(tile) - kBytesPerTile;
  surfels_ += tile.surfels.size();
  tiles_[key] = std::make_shared<const Tile>(std::move(tile));
  ++changes_;
}

void TileCache::forget(const TileKey& key) {
  if (const auto there = tiles_.find(key); there != tiles_.end()) {
    bytes_ -= sizeOf(*there->second) - kBytesPerTile;
    surfels_ -= there->second->surfels.size();
    tiles_.erase(there);
    ++changes_;
  }
  bytes_ -= revisions_.erase(key) * kBytesPerTile;
}

void TileCache::stayNear(const Eigen::Vector3d& position_m, double radius_m) {
  limitReach(position_m, radius_m);
  stored_.write(position_m);
  forgetFar(position_m);
  bringFromDisk(position_m);
  forgetFar(position_m);
}

void TileCache::limitReach(const Eigen::Vector3d& position_m, double radius_m) {
  if (reach_m_ <= 0) reach_m_ = radius_m;
  double near_bytes = 0, near_entries = 0;
  for (const auto& [key, revision] : revisions_) {
    if (distanceToTile(key, position_m) > reach_m_) continue;
    const auto there = tiles_.find(key);
    near_bytes += static_cast<double>(there == tiles_.end() ? kBytesPerTile : sizeOf(*there->second));
    near_entries += 1;
  }
  if (near_bytes <= kRoomToGrow * static_cast<double>(most_bytes_) &&
      near_entries <= kRoomToGrow * static_cast<double>(kMostEntries))
    reach_m_ += double{kTileEdge_m};
  reach_m_ = std::min(reach_m_, radius_m);
}

bool TileCache::fits(double share) const {
  return static_cast<double>(bytes_) <= share * static_cast<double>(most_bytes_) &&
         static_cast<double>(revisions_.size()) <= share * static_cast<double>(kMostEntries);
}

void TileCache::forgetFar(const Eigen::Vector3d& position_m) {
  if (fits(1)) return;
  std::vector<std::pair<double, TileKey>> by_distance;
  by_distance.reserve(revisions_.size());
  for (const auto& [key, revision] : revisions_) by_distance.emplace_back(distanceToTile(key, position_m), key);
  std::sort(by_distance.begin(), by_distance.end());
  while (!by_distance.empty() && !fits(kRoomAfterForgetting)) {
    const auto& [distance, key] = by_distance.back();
    forgotten_ += tiles_.count(key);
    forget(key);
    // What was forgotten must not be asked for at once.
    reach_m_ = std::min(reach_m_, std::max(double{kTileEdge_m}, distance - double{kTileEdge_m}));
    by_distance.pop_back();
  }
}

// Nearest first, as many as a frame can wait for and memory has room for.
void TileCache::bringFromDisk(const Eigen::Vector3d& position_m) {
  unread_.clear();
  if (stored_.revisions().empty()) return;
  std::vector<std::pair<double, TileKey>> near;
  for (const auto& [key, revision] : stored_.revisions())
    if (const double d = distanceToTile(key, position_m); d <= reach_m_ && !revisions_.contains(key))
      near.emplace_back(d, key);
  std::sort(near.begin(), near.end());
  auto next = near.begin();
  for (size_t brought = 0; next != near.end() && brought < kBytesFromDiskAtOnce && fits(1); ++next) {
    auto tile = stored_.read(next->second);
    if (!tile) return;  // and all that was there is gone
    brought += sizeOf(*tile);
    ++from_disk_;
    take(std::move(*tile));
  }
  for (; next != near.end() && revisions_.size() + unread_.size() < kMostEntries; ++next)
    unread_[next->second] = stored_.revisions().at(next->second);
}

uint64_t TileCache::hash() const {
  TileHash hash;
  for (const auto& [key, tile] : tiles_) hash.add(*tile);
  return hash.value();
}

std::vector<HeldTile> TileCache::held() const {
  std::vector<HeldTile> held;
  held.reserve(revisions_.size() + unread_.size());
  for (const auto& [key, revision] : revisions_) held.push_back({key, revision});
  for (const auto& [key, revision] : unread_) held.push_back({key, revision});
  return held;
}

}  // namespace comap
