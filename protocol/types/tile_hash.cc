#include "protocol/types/tile_hash.h"

namespace comap {

// FNV-1a, 64 bits.
void TileHash::integer(uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) state_ = (state_ ^ static_cast<uint8_t>(value >> (8 * i))) * 0x100000001b3ull;
}

void TileHash::add(const Tile& tile) {
  if (tile.surfels.empty()) return;  // removed: no content
  for (const int32_t at : {tile.key.x, tile.key.y, tile.key.z}) integer(static_cast<uint32_t>(at), 4);
  integer(tile.surfels.size(), 8);
  for (const TileSurfel& s : tile.surfels) {
    for (const uint16_t v : {s.x, s.y, s.z}) integer(v, 2);
    for (const uint8_t v : {s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors})
      integer(v, 1);
  }
}

uint64_t hashTiles(std::span<const Tile> tiles) {
  TileHash hash;
  for (const Tile& tile : tiles) hash.add(tile);
  return hash.value();
}

}  // namespace comap
