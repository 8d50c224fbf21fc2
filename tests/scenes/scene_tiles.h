// A scene as the core would send it: tiles of what some views saw, with the views as places.
#pragma once

#include <vector>

#include "protocol/types/tile.h"
#include "tests/scenes/scene.h"

namespace comap {

/// Tiles of map `map`, whose frame is the world's, at `revision`: one surfel for each cube of 1 cm that a view from
/// one of `T_world_cams` with smallCamera() saw, and a place for each view with a code of the standard book.
std::vector<Tile> sceneTiles(const Scene& scene, const std::vector<Pose>& T_world_cams, const MapId& map,
                             uint64_t revision = 1);

}  // namespace comap
