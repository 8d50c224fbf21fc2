// Which of a map's keyframes go to robots as places that they may find themselves at.
#pragma once

#include <span>
#include <vector>

#include "mapping_core/tiles/tile_index.h"
#include "protocol/types/tile.h"

namespace comap {

/// A view is left out if one of its cube that is kept already looks the same way from nearly the same point, and if
/// the cube holds `most_per_tile`.
struct PlaceOptions {
  double apart_m = 0.25, apart_rad = 0.26;
  size_t most_per_tile = 32;
  /// A place that tiles hold already keeps its pose there until its keyframe is farther from it than this: it is a
  /// start for an alignment, and not worth a new tile each time the graph stirs.
  double still_m = 0.03, still_rad = 0.02;
};

/// `tiles`: those of `map` whose surfels have changed since `current` was; they get the places of `views`, which are
/// all of the map. Tiles of which only the places have changed are added, with the surfels that `current` has there;
/// cubes without surfels get tiles of their own. Views without a code are left out.
void addPlaces(const MapId& map, std::span<const TilePlace> views, const TileIndex& current,
               const PlaceOptions& options, std::vector<Tile>& tiles);

}  // namespace comap
