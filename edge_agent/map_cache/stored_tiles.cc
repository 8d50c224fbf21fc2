#include "edge_agent/map_cache/stored_tiles.h"

namespace comap {

void StoredTiles::setMap(const MapId& map) {
  if (!store_ || map == map_) return;
  write(position_m_);
  map_ = map;
  position_m_ = Eigen::Vector3d::Zero();
  revisions_.clear();
  if (map.empty() || !store_) return;
  auto known = store_->revisions(map);
  if (!known) return leave(known.error());
  revisions_ = std::move(*known);
  if (!revisions_.empty()) log_(std::to_string(revisions_.size()) + " tiles of map " + map + " are known from before");
}

void StoredTiles::put(const TileKey& key, uint64_t revision, std::span<const uint8_t> encoded) {
  if (!store_) return;
  waiting_[key] = {key, revision, {encoded.begin(), encoded.end()}};
  if (encoded.empty())
    revisions_.erase(key);
  else
    revisions_[key] = revision;
}

void StoredTiles::write(const Eigen::Vector3d& position_m) {
  position_m_ = position_m;
  if (!store_ || waiting_.empty()) return;
  std::vector<TileStore::Change> changes;
  changes.reserve(waiting_.size());
  for (auto& [key, change] : waiting_) changes.push_back(std::move(change));
  waiting_.clear();
  const auto gone = store_->write(map_, changes, position_m);
  if (!gone) return leave(gone.error());
  for (const TileKey& key : *gone) revisions_.erase(key);
}

std::optional<Tile> StoredTiles::read(const TileKey& key) {
  if (!store_) return std::nullopt;
  auto tile = store_->read(key);
  if (tile) return std::move(*tile);
  leave(tile.error());
  return std::nullopt;
}

// What was on a disk that fails is forgotten: the core sends it again.
void StoredTiles::leave(const Error& problem) {
  const std::string path = store_->path();
  store_.reset();
  revisions_.clear();
  waiting_.clear();
  if (problem.code != ErrorCode::kBadData) {
    removeTileStore(path);  // keyframes, which come from nowhere else, need the room more
    log_("tiles are kept on disk no longer, those that were are deleted: " + problem.text);
    return;
  }
  log_("tiles on disk are dropped: " + problem.text);
  removeTileStore(path);
  auto anew = TileStore::open(path, quota_bytes_);
  if (anew)
    store_.emplace(std::move(*anew));
  else
    log_("tiles are kept on disk no longer: " + anew.error().text);
}

}  // namespace comap
