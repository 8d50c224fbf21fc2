#include "mapping_core/service/live_tiles.h"

#include <algorithm>
#include <thread>

#include "mapping_core/tiles/tile_places.h"

namespace comap {
namespace {

// More find nothing to do: a renewal cuts a hundred tiles, a merge a thousand.
constexpr unsigned kMostThreads = 4;

}  // namespace

LiveTiles::LiveTiles(const TileOptions& options)
    : options_(options),
      workers_(static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, kMostThreads))) {}

Result<std::vector<Tile>> LiveTiles::cut(MapBuilder& builder, const KeyframeId& anchor, const TileIndex& current) {
  TileCutter& cutter = cutters_.try_emplace(anchor, options_).first->second;
  const auto changes = builder.surfels(anchor).changesSince(cutter.moment());
  if (!changes) return changes.error();
  const MapId map = mapIdOf(anchor);
  std::vector<Tile> tiles = cutter.cut(map, *changes, &workers_);
  addPlaces(map, builder.placesOf(anchor), current, PlaceOptions{}, tiles);
  return tiles;
}

void LiveTiles::keepOnly(const ComponentSet& components) {
  std::erase_if(cutters_, [&](const auto& entry) { return components.anchorOf(entry.first) != entry.first; });
}

}  // namespace comap
