// The part of the joint map that this robot holds.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// Holds tiles of one map: the one the robot's last correction names. Bounded: beyond its bytes the tiles farthest from
/// the robot are forgotten, and since held() names them no longer, the core sends them again when they are in reach.
/// Thread rule: one thread.
class TileCache {
 public:
  static constexpr size_t kMostEntries = 30000;  ///< tiles and remembered removals; an interest takes 32 768

  explicit TileCache(size_t most_bytes = size_t{64} << 20) : most_bytes_(most_bytes) {}

  /// The robot belongs to this map now; tiles of another one are dropped.
  void setMap(const MapId& map);
  /// Takes a tile unless it is of another map or older than what is held. An empty tile removes. True if it changed
  /// anything.
  bool put(Tile tile);
  /// Where the robot is, metres in the map, and how far it would like to hold tiles. Forgets the farthest tiles if
  /// there are too many. Call it now and then, and after tiles were put.
  void stayNear(const Eigen::Vector3d& position_m, double radius_m);
  /// How far tiles are worth asking for: the radius of stayNear(), or less, if the cache cannot hold so many. It grows
  /// back, a tile's edge at a time, while there is room.
  double reach_m() const { return reach_m_; }

  const MapId& map() const { return map_; }
  /// None is empty. A tile never changes: a newer one takes its place.
  const std::map<TileKey, std::shared_ptr<const Tile>>& tiles() const { return tiles_; }
  uint64_t changes() const { return changes_; }  ///< grows with each change of map() or tiles()
  size_t surfels() const { return surfels_; }
  size_t bytes() const { return bytes_; }
  size_t forgotten() const { return forgotten_; }  ///< tiles, for want of room, since the start
  uint64_t hash() const;                           ///< of tiles(), see TileHash
  /// What an interest tells the core: revisions held, those of removed tiles included.
  std::vector<HeldTile> held() const;

 private:
  void forget(const TileKey& key);

  size_t most_bytes_;
  MapId map_;
  std::map<TileKey, std::shared_ptr<const Tile>> tiles_;
  std::map<TileKey, uint64_t> revisions_;  // of all that was heard of
  size_t bytes_ = 0, surfels_ = 0, forgotten_ = 0;
  double reach_m_ = 0;
  uint64_t changes_ = 0;
};

}  // namespace comap
