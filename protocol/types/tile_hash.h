// A number for the surfaces that tiles hold, to tell whether two sides hold the same.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/types/fnv1a.h"
#include "protocol/types/tile.h"

namespace comap {

/// 64 bits over keys and surfels, without map names, revisions and places. It depends on the order of the tiles: by
/// key.
class TileHash {
 public:
  void add(const Tile& tile);
  uint64_t value() const { return hash_.value(); }

 private:
  Fnv1a hash_;
};

/// Of `tiles`, sorted by key: equal maps, equal hashes.
uint64_t hashTiles(std::span<const Tile> tiles);

}  // namespace comap
