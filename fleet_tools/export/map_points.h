// A tile's surfels as points for other people's programs.
#pragma once

#include <vector>

#include "fleet_tools/export/ply.h"
#include "protocol/types/tile.h"

namespace comap {

/// In the order of the tile, in the map's frame.
std::vector<MapPoint> pointsOf(const Tile& tile);

}  // namespace comap
