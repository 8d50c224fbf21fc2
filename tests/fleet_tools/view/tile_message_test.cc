#include "fleet_tools/view/tile_message.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

namespace comap {
namespace {

Tile tileOf(size_t count, const std::string& map) {
  Tile tile{{map, -3, 7, 2}, 41};
  std::mt19937 random(5);
  for (size_t i = 0; i < count; ++i) {
    TileSurfel s;
    for (uint16_t* value : {&s.x, &s.y, &s.z}) *value = static_cast<uint16_t>(random());
    for (uint8_t* value : {&s.normal_u, &s.normal_v, &s.r, &s.g, &s.b, &s.log_radius, &s.confidence, &s.contributors})
      *value = static_cast<uint8_t>(random());
    tile.surfels.push_back(s);
  }
  return tile;
}

template <class T>
T at(const std::vector<uint8_t>& message, size_t offset) {
  T value;
  std::memcpy(&value, message.data() + kMessageHeadroom + offset, sizeof value);
  return value;
}

// As the page reads it.
std::vector<TileSurfel> surfelsIn(const std::vector<uint8_t>& message) {
  const size_t count = at<uint32_t>(message, 4), name = at<uint32_t>(message, 20);
  const size_t positions = 32 + (name + 3) / 4 * 4, shapes = positions + (6 * count + 3) / 4 * 4;
  const size_t looks = shapes + 4 * count;
  EXPECT_EQ(message.size(), kMessageHeadroom + looks + 4 * count);
  std::vector<TileSurfel> surfels;
  for (size_t i = 0; i < count; ++i) {
    const auto shape = at<std::array<uint8_t, 4>>(message, shapes + 4 * i);
    const auto look = at<std::array<uint8_t, 4>>(message, looks + 4 * i);
    surfels.push_back({at<uint16_t>(message, positions + 6 * i), at<uint16_t>(message, positions + 6 * i + 2),
                       at<uint16_t>(message, positions + 6 * i + 4), shape[0], shape[1], look[0], look[1], look[2],
                       shape[2], shape[3], look[3]});
  }
  return surfels;
}

std::vector<TileSurfel> sorted(std::vector<TileSurfel> surfels) {
  std::sort(surfels.begin(), surfels.end(),
            [](const TileSurfel& a, const TileSurfel& b) { return std::memcmp(&a, &b, sizeof a) < 0; });
  return surfels;
}

TEST(TileMessage, HoldsTheHeadAndEverySurfelOnce) {
  for (const size_t count : {size_t{0}, size_t{1}, size_t{3}, size_t{1000}}) {
    for (const std::string& map : {std::string("a-1-0"), std::string("robot-17-3"), std::string()}) {
      const Tile tile = tileOf(count, map);
      const auto message = tileMessage(tile);
      EXPECT_EQ(at<uint32_t>(message, 0), 1u);
      EXPECT_EQ(at<uint32_t>(message, 4), count);
      EXPECT_EQ(at<int32_t>(message, 8), -3);
      EXPECT_EQ(at<int32_t>(message, 12), 7);
      EXPECT_EQ(at<int32_t>(message, 16), 2);
      EXPECT_EQ(at<double>(message, 24), 41.0);
      EXPECT_EQ(std::string(reinterpret_cast<const char*>(message.data()) + kMessageHeadroom + 32, map.size()), map);
      EXPECT_EQ(sorted(surfelsIn(message)), sorted(tile.surfels));
    }
  }
}

TEST(TileMessage, AnyFirstPartIsSpreadOverTheTile) {
  Tile tile = tileOf(4000, "m");
  for (size_t i = 0; i < tile.surfels.size(); ++i) tile.surfels[i].x = static_cast<uint16_t>(16 * i);  // in order
  const auto surfels = surfelsIn(tileMessage(tile));
  for (const size_t part : {size_t{100}, size_t{1000}}) {
    std::array<size_t, 4> quarters{};
    for (size_t i = 0; i < part; ++i) ++quarters[std::min<size_t>(3, surfels[i].x / 16000)];
    for (const size_t quarter : quarters) {
      EXPECT_GT(quarter, part / 8) << part;
      EXPECT_LT(quarter, part / 2) << part;
    }
  }
  EXPECT_EQ(tileMessage(tile), tileMessage(tile));
}

}  // namespace
}  // namespace comap
