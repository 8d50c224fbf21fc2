// A surfel as it goes into a tile, in numbers: what all ways of cutting a map into tiles have in common.
#pragma once

#include <compare>
#include <cstdint>
#include <vector>

#include "mapping_core/surfels/surfel_map.h"
#include "protocol/types/tile.h"

namespace comap {

/// A quantised surfel as three numbers, so that sorting by them puts tiles in order and, inside a tile, surfels in an
/// order that only their content decides.
struct TileEntry {
  uint64_t tile, position, rest;
  auto operator<=>(const TileEntry&) const = default;
};

/// Whether a surfel enters tiles: it is finite, sure enough, and not farther from the origin than keys reach.
bool entersTiles(const Surfel& surfel, float min_confidence);
/// `scratch`: of the map, or of none; its coordinates are overwritten.
TileEntry entryOf(const Surfel& surfel, TileKey& scratch);
/// The cube of the entry's tile, of this edge, that it lies in.
uint64_t cubeOf(const TileEntry& entry, double spacing_m);

TileKey keyOf(const MapId& map, const TileEntry& entry);
TileSurfel surfelOf(const TileEntry& entry);

}  // namespace comap
