// Surfels to tiles and back: which cube a surfel belongs to, and how it is quantised.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "mapping_core/surfels/surfel_map.h"
#include "protocol/types/tile.h"
#include "protocol/types/tile_hash.h"

namespace comap {

struct TileOptions {
  float min_confidence = 1.5f;  ///< surfels below do not enter tiles
  float spacing_m = 0;          ///< > 0: at most one surfel (the most confident) per cube of this size: level of detail
};

/// Cuts a map into tiles at revision 0, sorted by key; surfels inside a tile in a fixed order, so that equal maps
/// give equal tiles. Surfels that are not finite are left out.
std::vector<Tile> buildTiles(const MapId& map, std::span<const Surfel> surfels, const TileOptions& options);

TileSurfel quantise(const Surfel& surfel, const TileKey& key);
/// Within 8 um, 1 degree of normal, 1.5 % of radius of what was quantised. Owner is 0.
Surfel dequantise(const TileSurfel& surfel, const TileKey& key);

}  // namespace comap
