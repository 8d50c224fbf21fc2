#include "mapping_core/tiles/tile_builder.h"

#include <algorithm>
#include <tuple>

#include "mapping_core/tiles/tile_entry.h"

namespace comap {
namespace {

struct SpacedEntry {
  uint64_t cube;  // inside the tile
  float confidence;
  TileEntry entry;
};

std::vector<TileEntry> thinOut(std::vector<SpacedEntry> spaced) {
  std::sort(spaced.begin(), spaced.end(), [](const SpacedEntry& a, const SpacedEntry& b) {
    return std::tie(a.entry.tile, a.cube, b.confidence, a.entry.position, a.entry.rest) <
           std::tie(b.entry.tile, b.cube, a.confidence, b.entry.position, b.entry.rest);
  });
  std::vector<TileEntry> entries;
  for (size_t i = 0; i < spaced.size(); ++i) {
    const bool first =
        i == 0 || spaced[i].entry.tile != spaced[i - 1].entry.tile || spaced[i].cube != spaced[i - 1].cube;
    if (first) entries.push_back(spaced[i].entry);
  }
  return entries;
}

}  // namespace

std::vector<Tile> buildTiles(const MapId& map, std::span<const Surfel> surfels, const TileOptions& options) {
  std::vector<TileEntry> entries;
  TileKey scratch;
  if (options.spacing_m > 0) {
    std::vector<SpacedEntry> spaced;
    for (const Surfel& surfel : surfels) {
      if (!entersTiles(surfel, options.min_confidence)) continue;
      const TileEntry entry = entryOf(surfel, scratch);
      spaced.push_back({cubeOf(entry, double{options.spacing_m}), surfel.confidence, entry});
    }
    entries = thinOut(std::move(spaced));
  } else {
    entries.reserve(surfels.size());
    for (const Surfel& surfel : surfels) {
      if (entersTiles(surfel, options.min_confidence)) entries.push_back(entryOf(surfel, scratch));
    }
  }
  std::sort(entries.begin(), entries.end());

  std::vector<Tile> tiles;
  for (size_t i = 0; i < entries.size();) {
    const uint64_t code = entries[i].tile;
    size_t end = i;
    while (end < entries.size() && entries[end].tile == code) ++end;
    Tile& tile = tiles.emplace_back();
    tile.key = keyOf(map, entries[i]);
    tile.surfels.reserve(end - i);
    for (; i < end; ++i) tile.surfels.push_back(surfelOf(entries[i]));
  }
  return tiles;
}

}  // namespace comap
