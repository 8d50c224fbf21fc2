#include "fleet_tools/view/tile_message.h"

#include <cstring>
#include <numeric>
#include <random>

namespace comap {
namespace {

constexpr size_t kHeadBytes = 32;
constexpr uint32_t kTileKind = 1;

size_t upToFour(size_t bytes) { return (bytes + 3) / 4 * 4; }

// By hand: std::shuffle differs between libraries.
std::vector<uint32_t> scattered(size_t count) {
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::minstd_rand random(1);
  for (size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

template <class T>
void put(uint8_t* at, T value) {
  std::memcpy(at, &value, sizeof value);
}

}  // namespace

std::vector<uint8_t> tileMessage(const Tile& tile) {
  const size_t count = tile.surfels.size();
  const size_t positions = kHeadBytes + upToFour(tile.key.map.size());
  const size_t shapes = positions + upToFour(6 * count), looks = shapes + 4 * count;
  std::vector<uint8_t> message(kMessageHeadroom + looks + 4 * count);
  uint8_t* const start = message.data() + kMessageHeadroom;
  put(start, kTileKind);
  put(start + 4, static_cast<uint32_t>(count));
  put(start + 8, tile.key.x);
  put(start + 12, tile.key.y);
  put(start + 16, tile.key.z);
  put(start + 20, static_cast<uint32_t>(tile.key.map.size()));
  put(start + 24, static_cast<double>(tile.revision));
  if (!tile.key.map.empty()) std::memcpy(start + kHeadBytes, tile.key.map.data(), tile.key.map.size());
  uint8_t *position = start + positions, *shape = start + shapes, *look = start + looks;
  for (const uint32_t index : scattered(count)) {
    const TileSurfel& s = tile.surfels[index];
    put(position, s.x);
    put(position + 2, s.y);
    put(position + 4, s.z);
    for (const uint8_t value : {s.normal_u, s.normal_v, s.log_radius, s.confidence}) *shape++ = value;
    for (const uint8_t value : {s.r, s.g, s.b, s.contributors}) *look++ = value;
    position += 6;
  }
  return message;
}

}  // namespace comap
