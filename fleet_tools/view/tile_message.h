// A map tile as browsers get it: one binary WebSocket message whose columns go to the graphics card as they are.
#pragma once

#include <cstdint>
#include <vector>

#include "protocol/types/tile.h"

namespace comap {

/// Free bytes at the front of every message, for what the WebSocket library writes before it.
inline constexpr size_t kMessageHeadroom = 32;

/// Little endian, after the headroom:
///   0 uint32 1 = tile          4 uint32 surfels; 0: the tile is no more
///   8 int32 x, y, z of the key 20 uint32 bytes of the map's name
///  24 float64 revision         32 the map's name, zeros up to a multiple of 4
///  then uint16 x y z a surfel, zeros up to a multiple of 4, then four bytes a surfel: normal u, v, log_radius,
///  confidence; then four: r, g, b, contributors. Meaning as in TileSurfel.
/// Surfels come in a fixed random order, so that any first part of them is spread evenly over the tile.
std::vector<uint8_t> tileMessage(const Tile& tile);

}  // namespace comap
