#include "mapping_core/tiles/tile_cutter.h"

#include <algorithm>
#include <tuple>
#include <unordered_map>

#include "mapping_core/tiles/tile_entry.h"

namespace comap {

std::vector<Tile> TileCutter::cut(const MapId& map, const SurfelChanges& changes) {
  std::set<uint64_t> changed;
  std::vector<uint64_t> present = changes.blocks, gone;
  std::sort(present.begin(), present.end());
  for (const auto& [block, tiles] : tiles_of_)
    if (!std::binary_search(present.begin(), present.end(), block)) gone.push_back(block);
  for (const uint64_t block : gone) take(block, {}, changed);
  for (const SurfelBlock& block : changes.changed) take(block.number, block.surfels, changed);
  moment_ = changes.moment;
  std::vector<Tile> tiles;
  tiles.reserve(changed.size());
  for (const uint64_t tile : changed) {
    tiles.push_back(tileOf(map, tile));
    if (tiles.back().empty()) pieces_.erase(tile);
  }
  return tiles;
}

void TileCutter::take(uint64_t block, std::span<const Surfel> surfels, std::set<uint64_t>& changed) {
  std::unordered_map<uint64_t, std::vector<Grain>> now;
  TileKey scratch;
  for (const Surfel& surfel : surfels) {
    if (!entersTiles(surfel, options_.min_confidence)) continue;
    const TileEntry entry = entryOf(surfel, scratch);
    now[entry.tile].push_back({entry.position, entry.rest, surfel.confidence});
  }
  std::vector<uint64_t>& tiles = tiles_of_[block];
  for (const uint64_t tile : tiles)
    if (!now.contains(tile) && put(tile, block, {})) changed.insert(tile);
  tiles.clear();
  for (auto& [tile, grains] : now) {
    tiles.push_back(tile);
    if (put(tile, block, std::move(grains))) changed.insert(tile);
  }
  if (tiles.empty()) tiles_of_.erase(block);
}

// True if that is another piece than before.
bool TileCutter::put(uint64_t tile, uint64_t block, std::vector<Grain> grains) {
  std::vector<Piece>& pieces = pieces_[tile];
  const auto known = std::find_if(pieces.begin(), pieces.end(), [&](const Piece& one) { return one.block == block; });
  if (grains.empty()) {
    if (known != pieces.end()) pieces.erase(known);
    return true;
  }
  if (known == pieces.end()) {
    pieces.push_back({block, std::move(grains)});
    return true;
  }
  if (known->grains == grains) return false;
  known->grains = std::move(grains);
  return true;
}

Tile TileCutter::tileOf(const MapId& map, uint64_t tile) const {
  struct Spaced {
    uint64_t cube;
    float confidence;
    TileEntry entry;
  };
  std::vector<Spaced> spaced;
  const double spacing_m = double{options_.spacing_m};
  for (const Piece& piece : pieces_.at(tile))
    for (const Grain& grain : piece.grains) {
      const TileEntry entry{tile, grain.position, grain.rest};
      spaced.push_back({spacing_m > 0 ? cubeOf(entry, spacing_m) : 0, grain.confidence, entry});
    }
  if (spacing_m > 0) {
    std::sort(spaced.begin(), spaced.end(), [](const Spaced& a, const Spaced& b) {
      return std::tie(a.cube, b.confidence, a.entry) < std::tie(b.cube, a.confidence, b.entry);
    });
    const auto same = [](const Spaced& a, const Spaced& b) { return a.cube == b.cube; };
    spaced.erase(std::unique(spaced.begin(), spaced.end(), same), spaced.end());
  }
  std::sort(spaced.begin(), spaced.end(), [](const Spaced& a, const Spaced& b) { return a.entry < b.entry; });
  Tile result{keyOf(map, {tile, 0, 0}), 0};
  result.surfels.reserve(spaced.size());
  for (const Spaced& one : spaced) result.surfels.push_back(surfelOf(one.entry));
  return result;
}

}  // namespace comap
