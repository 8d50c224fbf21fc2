#include "edge_agent/map_cache/tile_cache.h"

#include <algorithm>
#include <cmath>

#include "protocol/types/tile_hash.h"

namespace comap {
namespace {

constexpr size_t kBytesPerTile = 256;                            // key, map's name, revision, two nodes of trees
constexpr double kRoomAfterForgetting = 0.9, kRoomToGrow = 0.7;  // of the bytes and entries

size_t sizeOf(const Tile& tile) {
  size_t bytes = kBytesPerTile + tile.surfels.capacity() * sizeof(TileSurfel);
  for (const TilePlace& place : tile.places) bytes += sizeof(TilePlace) + place.code.codes.capacity();
  return bytes;
}

double distanceTo(const TileKey& key, const Eigen::Vector3d& position_m) {
  const Eigen::Vector3d corner = Eigen::Vector3d(key.x, key.y, key.z) * double{kTileEdge_m};
  return (position_m.cwiseMax(corner).cwiseMin(corner + Eigen::Vector3d::Constant(double{kTileEdge_m})) - position_m)
      .norm();
}

}  // namespace

void TileCache::setMap(const MapId& map) {
  if (map == map_) return;
  map_ = map;
  tiles_.clear();
  revisions_.clear();
  bytes_ = surfels_ = 0;
  ++changes_;
}

bool TileCache::put(Tile tile) {
  if (tile.key.map != map_) return false;
  if (const auto known = revisions_.find(tile.key); known != revisions_.end()) {
    if (tile.revision <= known->second) return false;
  }
  const TileKey key = tile.key;
  forget(key);
  revisions_[key] = tile.revision;
  bytes_ += kBytesPerTile;
  if (tile.empty()) return true;
  bytes_ += sizeOf(tile) - kBytesPerTile;
  surfels_ += tile.surfels.size();
  tiles_[key] = std::make_shared<const Tile>(std::move(tile));
  ++changes_;
  return true;
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
  const auto most_bytes = static_cast<double>(most_bytes_), most_entries = static_cast<double>(kMostEntries);
  std::vector<std::pair<double, TileKey>> by_distance;
  by_distance.reserve(revisions_.size());
  if (reach_m_ <= 0) reach_m_ = radius_m;
  double near_bytes = 0, near_entries = 0;
  for (const auto& [key, revision] : revisions_) {
    by_distance.emplace_back(distanceTo(key, position_m), key);
    if (by_distance.back().first > reach_m_) continue;
    const auto there = tiles_.find(key);
    near_bytes += static_cast<double>(there == tiles_.end() ? kBytesPerTile : sizeOf(*there->second));
    near_entries += 1;
  }
  if (near_bytes <= kRoomToGrow * most_bytes && near_entries <= kRoomToGrow * most_entries)
    reach_m_ += double{kTileEdge_m};
  reach_m_ = std::min(reach_m_, radius_m);

  const auto fits = [&](double share) {
    return static_cast<double>(bytes_) <= share * most_bytes &&
           static_cast<double>(revisions_.size()) <= share * most_entries;
  };
  if (fits(1)) return;
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

uint64_t TileCache::hash() const {
  TileHash hash;
  for (const auto& [key, tile] : tiles_) hash.add(*tile);
  return hash.value();
}

std::vector<HeldTile> TileCache::held() const {
  std::vector<HeldTile> held;
  held.reserve(revisions_.size());
  for (const auto& [key, revision] : revisions_) held.push_back({key, revision});
  return held;
}

}  // namespace comap
