#include "protocol/types/tile_hash.h"

namespace comap {

void TileHash::add(const Tile& tile) {
  if (tile.surfels.empty()) return;  // removed: no content
  for (const int32_t at : {tile.key.x, tile.key.y, tile.key.z}) hash_.addBytes(static_cast<uint32_t>(at), 4);
  hash_.addBytes(tile.surfels.size(), 8);
  for (const TileSurfel& s : tile.surfels) {
    for (const uint16_t v : {s.x, s.y, s.z}) hash_.addBytes(v, 2);
    for (const uint8_t v : {s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors})
      hash_.addBytes(v, 1);
  }
}

uint64_t hashTiles(std::span<const Tile> tiles) {
  TileHash hash;
  for (const Tile& tile : tiles) hash.add(tile);
  return hash.value();
}

}  // namespace comap
