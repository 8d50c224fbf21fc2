#include "fleet_tools/export/map_points.h"

#include "mapping_core/tiles/tile_builder.h"

namespace comap {

std::vector<MapPoint> pointsOf(const Tile& tile) {
  std::vector<MapPoint> points;
  points.reserve(tile.surfels.size());
  for (const TileSurfel& packed : tile.surfels) {
    const Surfel s = dequantise(packed, tile.key);
    points.push_back({s.position, s.normal, s.colour, s.radius, s.confidence});
  }
  return points;
}

std::vector<MapPoint> pointsOf(std::span<const Surfel> surfels) {
  std::vector<MapPoint> points;
  points.reserve(surfels.size());
  for (const Surfel& surfel : surfels)
    points.push_back({surfel.position, surfel.normal, surfel.colour, surfel.radius, surfel.confidence});
  return points;
}

}  // namespace comap
