// The tiles of a map that grows: only those are cut anew of which something has changed.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "mapping_core/rgbd/row_workers.h"
#include "mapping_core/surfels/surfel_map.h"
#include "mapping_core/tiles/tile_builder.h"

namespace comap {

/// Keeps what goes into tiles of each block of surfels, 24 bytes a sure surfel. What it has returned, the later tile in
/// place of the earlier, is what buildTiles() makes of all surfels, to the bit. Of one map. Thread rule: one thread.
class TileCutter {
 public:
  explicit TileCutter(const TileOptions& options) : options_(options) {}

  /// Since when it does not know what has changed: what SurfelMap::changesSince() is to be asked.
  uint64_t moment() const { return moment_; }
  /// Takes in what has changed since moment(). Returns the tiles of which surfels have: at revision 0, sorted by key,
  /// those that have lost all surfels without any. `workers` may share the work; the result does not depend on them.
  std::vector<Tile> cut(const MapId& map, const SurfelChanges& changes, RowWorkers* workers = nullptr);

 private:
  struct Grain {
    uint64_t position, rest;  // as in TileEntry
    float confidence;
    bool operator==(const Grain&) const = default;
  };
  struct Piece {
    uint64_t block;
    std::vector<Grain> grains;
  };
  struct Share {
    uint64_t tile;
    std::vector<Grain> grains;
  };
  std::vector<Share> sharesOf(std::span<const Surfel> surfels) const;
  void take(uint64_t block, std::vector<Share> shares, std::set<uint64_t>& changed);
  bool put(uint64_t tile, uint64_t block, std::vector<Grain> grains);
  Tile tileOf(const MapId& map, uint64_t tile) const;

  TileOptions options_;
  uint64_t moment_ = 0;
  std::map<uint64_t, std::vector<Piece>> pieces_;       // of tiles
  std::map<uint64_t, std::vector<uint64_t>> tiles_of_;  // that a block has surfels in
};

}  // namespace comap
