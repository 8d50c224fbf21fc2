#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

// FNV-1a, 64 bits.
class Hash {
 public:
  void byte(uint8_t value) { state_ = (state_ ^ value) * 0x100000001b3ull; }
  void integer(uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) byte(static_cast<uint8_t>(value >> (8 * i)));
  }
  uint64_t value() const { return state_; }

 private:
  uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace

uint64_t hashTiles(std::span<const Tile> tiles) {
  Hash hash;
  for (const Tile& tile : tiles) {
    if (tile.surfels.empty()) continue;  // removed: no content
    for (const int32_t at : {tile.key.x, tile.key.y, tile.key.z}) hash.integer(static_cast<uint32_t>(at), 4);
    hash.integer(tile.surfels.size(), 8);
    for (const TileSurfel& s : tile.surfels) {
      for (const uint16_t v : {s.x, s.y, s.z}) hash.integer(v, 2);
      for (const uint8_t v : {s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors}) {
        hash.byte(v);
      }
    }
  }
  return hash.value();
}

}  // namespace comap
