#include "mapping_core/tiles/tile_builder.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace comap {
namespace {

// Tiles further from the origin do not fit the packed key; 524 km are enough for anything a robot maps.
constexpr int32_t kMaxTileCoordinate = 1 << 20;
constexpr double kMaxPosition_m = double{kTileEdge_m} * kMaxTileCoordinate;

// A quantised surfel as three numbers, so that sorting by them puts tiles in order and, inside a tile, surfels in an
// order that only their content decides.
struct Entry {
  uint64_t tile, position, rest;
  auto operator<=>(const Entry&) const = default;
};

struct SpacedEntry {
  uint64_t cube;  // inside the tile
  float confidence;
  Entry entry;
};

bool isUsable(const Surfel& s, float min_confidence) {
  if (!s.position.allFinite() || !s.normal.allFinite() || !std::isfinite(s.radius) || !std::isfinite(s.confidence)) {
    return false;
  }
  return s.confidence >= min_confidence && s.position.cwiseAbs().cast<double>().maxCoeff() < kMaxPosition_m;
}

uint64_t packTile(int32_t x, int32_t y, int32_t z) {
  const auto biased = [](int32_t v) { return static_cast<uint64_t>(v + kMaxTileCoordinate); };
  return biased(x) << 42 | biased(y) << 21 | biased(z);
}

int32_t unpackTile(uint64_t tile, int shift) {
  return static_cast<int32_t>(tile >> shift & 0x1fffff) - kMaxTileCoordinate;
}

Entry pack(const Surfel& surfel, TileKey& scratch) {
  const auto cell = [](float v) { return static_cast<int32_t>(std::floor(double{v} / double{kTileEdge_m})); };
  scratch.x = cell(surfel.position.x());
  scratch.y = cell(surfel.position.y());
  scratch.z = cell(surfel.position.z());
  const TileSurfel s = quantise(surfel, scratch);
  uint64_t rest = 0;
  for (const uint8_t v : {s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors}) {
    rest = rest << 8 | v;
  }
  return {packTile(scratch.x, scratch.y, scratch.z), uint64_t{s.x} << 32 | uint64_t{s.y} << 16 | s.z, rest};
}

TileSurfel unpack(const Entry& e) {
  const auto u16 = [&](int shift) { return static_cast<uint16_t>(e.position >> shift); };
  const auto u8 = [&](int shift) { return static_cast<uint8_t>(e.rest >> shift); };
  return {u16(32), u16(16), u16(0), u8(56), u8(48), u8(40), u8(32), u8(24), u8(16), u8(8), u8(0)};
}

std::vector<Entry> thinOut(std::vector<SpacedEntry> spaced) {
  std::sort(spaced.begin(), spaced.end(), [](const SpacedEntry& a, const SpacedEntry& b) {
    return std::tie(a.entry.tile, a.cube, b.confidence, a.entry.position, a.entry.rest) <
           std::tie(b.entry.tile, b.cube, a.confidence, b.entry.position, b.entry.rest);
  });
  std::vector<Entry> entries;
  for (size_t i = 0; i < spaced.size(); ++i) {
    const bool first =
        i == 0 || spaced[i].entry.tile != spaced[i - 1].entry.tile || spaced[i].cube != spaced[i - 1].cube;
    if (first) entries.push_back(spaced[i].entry);
  }
  return entries;
}

uint64_t cubeOf(const Entry& entry, double spacing_m) {
  const double cubes_per_step = double{kTileEdge_m} / 65536 / spacing_m;
  uint64_t cube = 0;
  for (const int shift : {32, 16, 0}) {
    const double at = (static_cast<double>(entry.position >> shift & 0xffff) + 0.5) * cubes_per_step;
    cube = cube << 16 | static_cast<uint64_t>(std::min(at, 65535.0));
  }
  return cube;
}

}  // namespace

std::vector<Tile> buildTiles(const MapId& map, std::span<const Surfel> surfels, const TileOptions& options) {
  std::vector<Entry> entries;
  TileKey scratch;
  if (options.spacing_m > 0) {
    std::vector<SpacedEntry> spaced;
    for (const Surfel& surfel : surfels) {
      if (!isUsable(surfel, options.min_confidence)) continue;
      const Entry entry = pack(surfel, scratch);
      spaced.push_back({cubeOf(entry, double{options.spacing_m}), surfel.confidence, entry});
    }
    entries = thinOut(std::move(spaced));
  } else {
    entries.reserve(surfels.size());
    for (const Surfel& surfel : surfels) {
      if (isUsable(surfel, options.min_confidence)) entries.push_back(pack(surfel, scratch));
    }
  }
  std::sort(entries.begin(), entries.end());

  std::vector<Tile> tiles;
  for (size_t i = 0; i < entries.size();) {
    const uint64_t code = entries[i].tile;
    size_t end = i;
    while (end < entries.size() && entries[end].tile == code) ++end;
    Tile& tile = tiles.emplace_back();
    tile.key = {map, unpackTile(code, 42), unpackTile(code, 21), unpackTile(code, 0)};
    tile.surfels.reserve(end - i);
    for (; i < end; ++i) tile.surfels.push_back(unpack(entries[i]));
  }
  return tiles;
}

}  // namespace comap
