#include "mapping_core/service/live_tiles.h"

#include "mapping_core/tiles/tile_places.h"

namespace comap {

Result<std::vector<Tile>> LiveTiles::cut(MapBuilder& builder, const KeyframeId& anchor, const TileIndex& current) {
  TileCutter& cutter = cutters_.try_emplace(anchor, options_).first->second;
  const auto changes = builder.surfels(anchor).changesSince(cutter.moment());
  if (!changes) return changes.error();
  const MapId map = mapIdOf(anchor);
  std::vector<Tile> tiles = cutter.cut(map, *changes);
  addPlaces(map, builder.placesOf(anchor), current, PlaceOptions{}, tiles);
  return tiles;
}

void LiveTiles::keepOnly(const ComponentSet& components) {
  std::erase_if(cutters_, [&](const auto& entry) { return components.anchorOf(entry.first) != entry.first; });
}

}  // namespace comap
