// Surfels as points for other people's programs.
#pragma once

#include <span>
#include <vector>

#include "fleet_tools/export/ply.h"
#include "mapping_core/surfels/surfel_map.h"
#include "protocol/types/tile.h"

namespace comap {

/// In the order of the tile, in the map's frame.
std::vector<MapPoint> pointsOf(const Tile& tile);
std::vector<MapPoint> pointsOf(std::span<const Surfel> surfels);

}  // namespace comap
