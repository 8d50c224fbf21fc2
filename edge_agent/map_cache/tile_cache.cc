#include "edge_agent/map_cache/tile_cache.h"

namespace comap {

void TileCache::setMap(const MapId& map) {
  if (map == map_) return;
  map_ = map;
  tiles_.clear();
  revisions_.clear();
}

bool TileCache::put(Tile tile) {
  if (tile.key.map != map_) return false;
  uint64_t& revision = revisions_[tile.key];
  if (tile.revision <= revision) return false;
  revision = tile.revision;
  if (tile.surfels.empty()) {
    tiles_.erase(tile.key);
  } else {
    const TileKey key = tile.key;
    tiles_[key] = std::move(tile);
  }
  return true;
}

size_t TileCache::surfels() const {
  size_t count = 0;
  for (const auto& [key, tile] : tiles_) count += tile.surfels.size();
  return count;
}

std::vector<HeldTile> TileCache::held() const {
  std::vector<HeldTile> held;
  held.reserve(revisions_.size());
  for (const auto& [key, revision] : revisions_) held.push_back({key, revision});
  return held;
}

}  // namespace comap
