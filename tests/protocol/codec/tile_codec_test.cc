#include "protocol/codec/tile_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

TEST(TileCodec, RoundTrip) {
  samples::Random random(1);
  for (const size_t surfels : {0, 1, 2, 100, 20000}) {
    const Tile tile = samples::tile(random, surfels);
    const auto bytes = encodeTile(tile);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeTile(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->key, tile.key);
    EXPECT_EQ(back->revision, tile.revision);
    EXPECT_EQ(back->surfels, tile.surfels);
    ASSERT_EQ(back->places.size(), tile.places.size());
    for (size_t i = 0; i < tile.places.size(); ++i) {
      EXPECT_TRUE(samples::near(back->places[i].T_map_cam, tile.places[i].T_map_cam));
      EXPECT_EQ(back->places[i].code, tile.places[i].code);
    }
    EXPECT_LT(bytes->size(), 14 * surfels + surfels / 100 + 200 + 420 * tile.places.size());
  }
}

TEST(TileCodec, TakesTheLimitAndNoMore) {
  Tile tile;
  tile.key.map = "m";
  tile.surfels.resize(kMaxTileSurfels);
  const auto bytes = encodeTile(tile);
  ASSERT_TRUE(bytes);
  EXPECT_LT(bytes->size(), 10000u);  // all alike
  ASSERT_TRUE(decodeTile(*bytes));
  tile.surfels.emplace_back();
  EXPECT_FALSE(encodeTile(tile));
  tile.surfels.clear();
  tile.places.resize(kMaxTilePlaces);
  EXPECT_TRUE(encodeTile(tile));
  tile.places.emplace_back();
  EXPECT_FALSE(encodeTile(tile));
}

TEST(TileCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  for (const size_t surfels : {0, 1, 50}) {
    const auto bytes = encodeTile(samples::tile(random, surfels));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) {
      const auto tile = decodeTile(bad);
      if (!tile) return false;
      EXPECT_LE(tile->surfels.size(), kMaxTileSurfels);
      return true;
    });
  }
}

}  // namespace
}  // namespace comap
