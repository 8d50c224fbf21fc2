// What a tile cache has on disk: the store, what is still to be written to it, and what it holds of the current map.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "edge_agent/map_cache/tile_store.h"

namespace comap {

/// Never fails: a store that does is told of and left, one that is damaged is begun anew. Thread rule: one thread.
class StoredTiles {
 public:
  using Log = std::function<void(const std::string& line)>;
  StoredTiles() = default;  ///< holds nothing
  /// `quota_bytes` as for `store`, which may have to be made anew.
  StoredTiles(TileStore store, uint64_t quota_bytes, Log log)
      : store_(std::move(store)), quota_bytes_(quota_bytes), log_(std::move(log)) {}

  bool isOpen() const { return store_.has_value(); }
  /// What was put is written; then it is about this map.
  void setMap(const MapId& map);
  /// What the disk holds, or will, of this map.
  const std::map<TileKey, uint64_t>& revisions() const { return revisions_; }
  /// To be written; `encoded` empty: removed.
  void put(const TileKey& key, uint64_t revision, std::span<const uint8_t> encoded);
  /// Writes what was put. The robot is at `position_m` of the map.
  void write(const Eigen::Vector3d& position_m);
  /// Nothing if it is not there or damaged; it is then no longer among revisions().
  std::optional<Tile> read(const TileKey& key);

 private:
  void leave(const Error& problem);

  std::optional<TileStore> store_;
  uint64_t quota_bytes_ = 0;
  Log log_;
  MapId map_;
  std::map<TileKey, uint64_t> revisions_;
  std::map<TileKey, TileStore::Change> waiting_;
  Eigen::Vector3d position_m_ = Eigen::Vector3d::Zero();
};

}  // namespace comap
