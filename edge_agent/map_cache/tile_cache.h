// The part of the joint map that this robot holds.
#pragma once

#include <map>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// Holds tiles of one map: the one the robot's last correction names. Thread rule: one thread.
class TileCache {
 public:
  /// The robot belongs to this map now; tiles of another one are dropped.
  void setMap(const MapId& map);
  /// Takes a tile unless it is of another map or older than what is held. An empty tile removes. True if it changed
  /// anything.
  bool put(Tile tile);

  const MapId& map() const { return map_; }
  const std::map<TileKey, Tile>& tiles() const { return tiles_; }
  size_t surfels() const;
  /// What an interest tells the core: revisions held, those of removed tiles included.
  std::vector<HeldTile> held() const;

 private:
  MapId map_;
  std::map<TileKey, Tile> tiles_;          // never empty ones
  std::map<TileKey, uint64_t> revisions_;  // of all that was heard of
};

}  // namespace comap
