// The current tiles of all maps with their revisions: what changed, what was removed, what a robot lacks.
#pragma once

#include <limits>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// A tile that a robot should get, at the revision that it then had.
struct TileDue {
  TileKey key;
  uint64_t revision = 0;
  bool removal = false;  ///< it is to be told that there is no such tile
  bool coarse = false;   ///< its coarse form, at that form's revision (coarse_tile.h)
};

/// Tiles of one map, for a loop.
struct TileRange {
  std::map<TileKey, Tile>::const_iterator first, last;
  auto begin() const { return first; }
  auto end() const { return last; }
  bool empty() const { return first == last; }
};

/// Thread rule: one thread at a time.
class TileIndex {
 public:
  /// Revisions begin above `revision`: those of an earlier life of the core must not look newer.
  explicit TileIndex(uint64_t revision = 0) : revision_(revision) {}

  /// Replaces all tiles of `map`: those that changed get a new revision, those gone become removals.
  /// Returns how many changed.
  size_t update(const MapId& map, std::vector<Tile> tiles);
  /// Replaces only these tiles of `map`; an empty one goes. Returns how many changed.
  size_t change(const MapId& map, std::vector<Tile> tiles);
  /// A map that was absorbed: its tiles go without a trace (robots learn it from their correction's map).
  void drop(const MapId& map);

  /// Tiles of `map` near the camera that differ from what is held, in the order in which they should go. Removals first
  /// of all. Of the others five in eight are the nearest that are left, where what is not ahead counts as twice as far;
  /// two are of what the last change has changed, as long as there is any, so that news do not wait for all that is
  /// near; one has been lacking for the longest, so that nothing waits for ever.
  std::vector<TileDue> lacking(const MapId& map, const Pose& T_map_cam, double radius_m,
                               std::span<const HeldTile> held) const;

  /// Whether there is any tile of `map`, removals included.
  bool holds(const MapId& map) const;
  std::vector<Tile> tiles(const MapId& map) const;
  /// Those of `map` by key, removals included.
  TileRange of(const MapId& map) const {
    constexpr int32_t kLow = std::numeric_limits<int32_t>::min(), kHigh = std::numeric_limits<int32_t>::max();
    return {tiles_.lower_bound({map, kLow, kLow, kLow}), tiles_.upper_bound({map, kHigh, kHigh, kHigh})};
  }
  /// Null if there is no such tile, or none any more.
  const Tile* find(const TileKey& key) const;
  const std::map<TileKey, Tile>& all() const { return tiles_; }  ///< removals, which are empty, included
  uint64_t revision() const { return revision_; }

 private:
  std::map<TileKey, Tile> tiles_;
  uint64_t revision_;  // grows by kRevisionStep per update that changed anything
};

}  // namespace comap
