// The part of the joint map that this robot holds.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "edge_agent/map_cache/stored_tiles.h"
#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// Holds tiles of one map: the one the robot's last correction names. Bounded: beyond its bytes the tiles farthest from
/// the robot are forgotten, and since held() names them no longer, the core sends them again when they are in reach.
/// With a store, tiles are also on disk, and come from there when they are in reach, also after a restart; held() names
/// those on disk that are in reach, so that the core sends only what has changed. Thread rule: one thread.
class TileCache {
 public:
  static constexpr size_t kMostEntries = 30000;  ///< tiles and remembered removals; an interest takes 32 768

  explicit TileCache(size_t most_bytes = size_t{64} << 20) : most_bytes_(most_bytes) {}

  /// Keeps tiles on disk too, from now on.
  void keep(StoredTiles stored) { stored_ = std::move(stored); }

  /// The robot belongs to this map now; tiles of another one are dropped.
  void setMap(const MapId& map);
  /// Takes a tile unless it is of another map or older than what is held; than what an earlier start has left it may be
  /// older, since the core's store may have been put back. An empty tile removes. `encoded`: as it came, for the disk.
  /// True if it changed anything.
  bool put(Tile tile, std::span<const uint8_t> encoded = {});
  /// Where the robot is, metres in the map, and how far it would like to hold tiles. Forgets the farthest tiles if
  /// there are too many, brings tiles in reach from disk, some at a time, and writes what was put to it. Call it now
  /// and then, and after tiles were put.
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
  size_t fromDisk() const { return from_disk_; }   ///< tiles that did not have to come over the link
  uint64_t hash() const;                           ///< of tiles(), see TileHash
  /// What an interest tells the core: revisions held, those of removed tiles included.
  std::vector<HeldTile> held() const;

 private:
  void forget(const TileKey& key);
  void take(Tile tile);
  void limitReach(const Eigen::Vector3d& position_m, double radius_m);
  bool fits(double share) const;
  void forgetFar(const Eigen::Vector3d& position_m);
  void bringFromDisk(const Eigen::Vector3d& position_m);

  size_t most_bytes_;
  MapId map_;
  std::map<TileKey, std::shared_ptr<const Tile>> tiles_;
  std::map<TileKey, uint64_t> revisions_;  // of all that was heard of
  StoredTiles stored_;
  std::map<TileKey, uint64_t> unread_;  // of an earlier start or forgotten: on disk alone, and in reach
  std::set<TileKey> earlier_;           // whose revisions are of an earlier start of this agent
  size_t bytes_ = 0, surfels_ = 0, forgotten_ = 0, from_disk_ = 0;
  double reach_m_ = 0;
  uint64_t changes_ = 0;
};

}  // namespace comap
