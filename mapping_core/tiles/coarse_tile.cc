#include "mapping_core/tiles/coarse_tile.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "protocol/types/tile_distance.h"
#include "protocol/types/tile_quantisation.h"
#include "protocol/types/tile_revision.h"

namespace comap {
namespace {

constexpr uint32_t kCubes = 10;         // an edge of a tile
constexpr size_t kFewestSurfels = 100;  // fewer go in one packet as they are
constexpr size_t kBytesPerSurfel = 7;   // as tiles are coded, on the average
constexpr size_t kBytesPerPlace = 300;
constexpr size_t kCoarsePart = 10;                               // of the bytes
constexpr float kRadius_m = 0.5f * 1.5f * kTileEdge_m / kCubes;  // discs of neighbouring cubes overlap

uint32_t cubeOf(const TileSurfel& surfel) {
  const auto cell = [](uint16_t at) { return at * kCubes / 65536u; };
  return (cell(surfel.x) * kCubes + cell(surfel.y)) * kCubes + cell(surfel.z);
}

}  // namespace

Tile coarsened(const Tile& tile) {
  Tile coarse{tile.key, coarseRevision(tile.revision), {}, tile.places};
  std::unordered_map<uint32_t, size_t> surest;  // of a cube, by place in the tile
  for (size_t i = 0; i < tile.surfels.size(); ++i) {
    const auto [known, is_new] = surest.try_emplace(cubeOf(tile.surfels[i]), i);
    if (!is_new && tile.surfels[i].confidence > tile.surfels[known->second].confidence) known->second = i;
  }
  std::vector<size_t> kept;
  for (const auto& [cube, i] : surest) kept.push_back(i);
  std::sort(kept.begin(), kept.end());
  TileSurfel large;
  quantiseDisc({cornerOf(tile.key).cast<float>(), Eigen::Vector3f::UnitZ(), kRadius_m}, tile.key, large);
  for (const size_t i : kept) {
    TileSurfel& surfel = coarse.surfels.emplace_back(tile.surfels[i]);
    surfel.log_radius = std::max(surfel.log_radius, large.log_radius);
  }
  return coarse;
}

size_t roughBytes(const Tile& tile) {
  return kBytesPerSurfel * tile.surfels.size() + kBytesPerPlace * tile.places.size();
}

std::vector<TileDue> withCoarse(const TileIndex& index, std::vector<TileDue> due, std::span<const HeldTile> held) {
  const auto helps = [&](const Tile& tile) {
    if (tile.surfels.size() < kFewestSurfels) return false;
    const auto its = std::lower_bound(held.begin(), held.end(), tile.key,
                                      [](const HeldTile& one, const TileKey& key) { return one.key < key; });
    if (its == held.end() || its->key != tile.key) return true;
    return isCoarse(its->revision, tile.revision) && its->revision != coarseRevision(tile.revision);
  };
  std::vector<TileDue> all;
  size_t next = 0, coarse_bytes = 0, full_bytes = 0;
  for (size_t i = 0; i < due.size(); ++i) {
    all.push_back(due[i]);
    if (const Tile* tile = due[i].removal ? nullptr : index.find(due[i].key)) full_bytes += roughBytes(*tile);
    for (next = std::max(next, i + 1); next < due.size() && coarse_bytes <= full_bytes; ++next) {
      const Tile* tile = due[next].removal ? nullptr : index.find(due[next].key);
      if (tile == nullptr || !helps(*tile)) continue;
      all.push_back({due[next].key, coarseRevision(due[next].revision), false, true});
      coarse_bytes += roughBytes(*tile) / kCoarsePart;
    }
  }
  return all;
}

}  // namespace comap
