#include "mapping_core/tiles/tile_entry.h"

#include <algorithm>
#include <cmath>

#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

// Tiles further from the origin do not fit the packed key; 524 km are enough for anything a robot maps.
constexpr int32_t kMaxTileCoordinate = 1 << 20;
constexpr double kMaxPosition_m = double{kTileEdge_m} * kMaxTileCoordinate;

uint64_t packTile(int32_t x, int32_t y, int32_t z) {
  const auto biased = [](int32_t v) { return static_cast<uint64_t>(v + kMaxTileCoordinate); };
  return biased(x) << 42 | biased(y) << 21 | biased(z);
}

int32_t unpackTile(uint64_t tile, int shift) {
  return static_cast<int32_t>(tile >> shift & 0x1fffff) - kMaxTileCoordinate;
}

}  // namespace

bool entersTiles(const Surfel& s, float min_confidence) {
  if (!s.position.allFinite() || !s.normal.allFinite() || !std::isfinite(s.radius) || !std::isfinite(s.confidence)) {
    return false;
  }
  return s.confidence >= min_confidence && s.position.cwiseAbs().cast<double>().maxCoeff() < kMaxPosition_m;
}

TileEntry entryOf(const Surfel& surfel, TileKey& scratch) {
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

uint64_t cubeOf(const TileEntry& entry, double spacing_m) {
  const double cubes_per_step = double{kTileEdge_m} / 65536 / spacing_m;
  uint64_t cube = 0;
  for (const int shift : {32, 16, 0}) {
    const double at = (static_cast<double>(entry.position >> shift & 0xffff) + 0.5) * cubes_per_step;
    cube = cube << 16 | static_cast<uint64_t>(std::min(at, 65535.0));
  }
  return cube;
}

TileKey keyOf(const MapId& map, const TileEntry& entry) {
  return {map, unpackTile(entry.tile, 42), unpackTile(entry.tile, 21), unpackTile(entry.tile, 0)};
}

TileSurfel surfelOf(const TileEntry& e) {
  const auto u16 = [&](int shift) { return static_cast<uint16_t>(e.position >> shift); };
  const auto u8 = [&](int shift) { return static_cast<uint8_t>(e.rest >> shift); };
  return {u16(32), u16(16), u16(0), u8(56), u8(48), u8(40), u8(32), u8(24), u8(16), u8(8), u8(0)};
}

}  // namespace comap
