// A tile in a tenth of its bytes, for a robot that lacks more than its link carries at once: all of the map roughly
// first, then each tile in full.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mapping_core/tiles/tile_index.h"
#include "protocol/types/tile.h"

namespace comap {

/// At most one surfel, the surest, of each cube of 5 cm, as large as the cube; places as they are. The revision is
/// coarseRevision() of the tile's. Fewer surfels than that are returned as they are.
Tile coarsened(const Tile& tile);

/// What is due, with the coarse forms of those tiles in between that a robot holds nothing of, or a coarse form of
/// earlier, and that are large enough to be worth it: so that half of the bytes are of either kind as long as coarse
/// ones are left, both in the order of `due`. `held` by key.
std::vector<TileDue> withCoarse(const TileIndex& index, std::vector<TileDue> due, std::span<const HeldTile> held);

/// About how many bytes a tile takes on the wire.
size_t roughBytes(const Tile& tile);

}  // namespace comap
