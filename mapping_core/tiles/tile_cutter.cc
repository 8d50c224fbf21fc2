#include "mapping_core/tiles/tile_cutter.h"

#include <algorithm>
#include <bit>

#include "mapping_core/tiles/tile_entry.h"

namespace comap {
namespace {

// Of the entries of one tile the surest of each cube, the least of equally sure ones; all if cubes have no size. A hash
// table, as sorting by cubes took half of the time that a merge's tiles do.
class SurestOfCubes {
 public:
  SurestOfCubes(size_t most, double spacing_m) : spacing_m_(spacing_m) {
    entries_.reserve(most);
    if (spacing_m <= 0) return;
    confidence_.reserve(most);
    cubes_.reserve(most);
    slots_.assign(std::bit_ceil(2 * most + 1), kFree);
  }

  void add(const TileEntry& entry, float confidence) {
    if (spacing_m_ <= 0) {
      entries_.push_back(entry);
      return;
    }
    const uint64_t cube = cubeOf(entry, spacing_m_);
    size_t at = (cube * 0x9e3779b97f4a7c15u >> 20) & (slots_.size() - 1);
    while (slots_[at] != kFree && cubes_[slots_[at]] != cube) at = (at + 1) & (slots_.size() - 1);
    const uint32_t i = slots_[at];
    if (i == kFree) {
      slots_[at] = static_cast<uint32_t>(entries_.size());
      entries_.push_back(entry);
      confidence_.push_back(confidence);
      cubes_.push_back(cube);
    } else if (confidence > confidence_[i] || (confidence == confidence_[i] && entry < entries_[i])) {
      entries_[i] = entry;
      confidence_[i] = confidence;
    }
  }

  std::vector<TileEntry> entries() && { return std::move(entries_); }

 private:
  static constexpr uint32_t kFree = ~0u;
  double spacing_m_;
  std::vector<TileEntry> entries_;
  std::vector<float> confidence_;
  std::vector<uint64_t> cubes_;
  std::vector<uint32_t> slots_;
};

}  // namespace

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
  const std::vector<Piece>& pieces = pieces_.at(tile);
  size_t count = 0;
  for (const Piece& piece : pieces) count += piece.grains.size();
  SurestOfCubes surest(count, double{options_.spacing_m});
  for (const Piece& piece : pieces)
    for (const Grain& grain : piece.grains) surest.add({tile, grain.position, grain.rest}, grain.confidence);
  std::vector<TileEntry> entries = std::move(surest).entries();
  std::sort(entries.begin(), entries.end());
  Tile result{keyOf(map, {tile, 0, 0}), 0};
  result.surfels.reserve(entries.size());
  for (const TileEntry& entry : entries) result.surfels.push_back(surfelOf(entry));
  return result;
}

}  // namespace comap
