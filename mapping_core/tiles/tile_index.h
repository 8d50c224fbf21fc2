// The current tiles of all maps with their revisions: what changed, what was removed, what a robot lacks.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// Thread rule: one thread at a time.
class TileIndex {
 public:
  /// Revisions begin above `revision`: those of an earlier life of the core must not look newer.
  explicit TileIndex(uint64_t revision = 0) : revision_(revision) {}

  /// Replaces all tiles of `map`: those that changed get a new revision, those gone become removals.
  /// Returns how many changed.
  size_t update(const MapId& map, std::vector<Tile> tiles);
  /// A map that was absorbed: its tiles go without a trace (robots learn it from their correction's map).
  void drop(const MapId& map);

  /// Tiles of `map` near the camera that differ from what is held, until `budget_bytes` are filled; at least one if any
  /// differs. Removals first of all, then nearest first, where what is not ahead counts as twice as far.
  std::vector<Tile> lacking(const MapId& map, const Pose& T_map_cam, double radius_m, std::span<const HeldTile> held,
                            size_t budget_bytes) const;

  /// Whether there is any tile of `map`, removals included.
  bool holds(const MapId& map) const;
  std::vector<Tile> tiles(const MapId& map) const;
  const std::map<TileKey, Tile>& all() const { return tiles_; }  ///< removals, which are empty, included
  uint64_t revision() const { return revision_; }

 private:
  std::map<TileKey, Tile> tiles_;
  uint64_t revision_;  // grows by one per update that changed anything
};

}  // namespace comap
