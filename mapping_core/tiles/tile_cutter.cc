#include "mapping_core/tiles/tile_cutter.h"

#include <algorithm>
#include <tuple>

#include "mapping_core/tiles/tile_entry.h"

namespace comap {

std::vector<Tile> TileCutter::cut(const MapId& map, const SurfelChanges& changes, RowWorkers* workers) {
  std::set<uint64_t> changed;
  std::vector<uint64_t> present = changes.blocks, gone;
  std::sort(present.begin(), present.end());
  for (const auto& [block, tiles] : tiles_of_)
    if (!std::binary_search(present.begin(), present.end(), block)) gone.push_back(block);
  for (const uint64_t block : gone) take(block, {}, changed);
  std::vector<std::vector<Share>> shares(changes.changed.size());
  shareRows(workers, static_cast<int>(shares.size()), [&](int begin, int end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i)
      shares[i] = sharesOf(changes.changed[i].surfels);
  });
  for (size_t i = 0; i < shares.size(); ++i) take(changes.changed[i].number, std::move(shares[i]), changed);
  moment_ = changes.moment;
  const std::vector<uint64_t> order(changed.begin(), changed.end());
  std::vector<Tile> tiles(order.size());
  shareRows(workers, static_cast<int>(order.size()), [&](int begin, int end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) tiles[i] = tileOf(map, order[i]);
  });
  for (size_t i = 0; i < order.size(); ++i)
    if (tiles[i].empty()) pieces_.erase(order[i]);
  return tiles;
}

// What a block has in each tile. Neighbours mostly lie in one.
std::vector<TileCutter::Share> TileCutter::sharesOf(std::span<const Surfel> surfels) const {
  std::vector<Share> shares;
  Share* last = nullptr;
  TileKey scratch;
  for (const Surfel& surfel : surfels) {
    if (!entersTiles(surfel, options_.min_confidence)) continue;
    const TileEntry entry = entryOf(surfel, scratch);
    if (last == nullptr || last->tile != entry.tile) {
      const auto known =
          std::find_if(shares.begin(), shares.end(), [&](const Share& one) { return one.tile == entry.tile; });
      last = known == shares.end() ? &shares.emplace_back(Share{entry.tile, {}}) : &*known;
    }
    last->grains.push_back({entry.position, entry.rest, surfel.confidence});
  }
  return shares;
}

void TileCutter::take(uint64_t block, std::vector<Share> shares, std::set<uint64_t>& changed) {
  std::vector<uint64_t> now;
  for (const Share& share : shares) now.push_back(share.tile);
  std::sort(now.begin(), now.end());
  const auto before = tiles_of_.find(block);
  if (before != tiles_of_.end())
    for (const uint64_t tile : before->second)
      if (!std::binary_search(now.begin(), now.end(), tile) && put(tile, block, {})) changed.insert(tile);
  for (Share& share : shares)
    if (put(share.tile, block, std::move(share.grains))) changed.insert(share.tile);
  if (now.empty())
    tiles_of_.erase(block);
  else
    tiles_of_[block] = std::move(now);
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
