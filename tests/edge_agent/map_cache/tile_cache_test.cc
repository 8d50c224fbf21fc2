#include "edge_agent/map_cache/tile_cache.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

Tile tile(const MapId& map, int x, uint64_t revision, size_t surfels) {
  return {{map, x, 0, 0}, revision, std::vector<TileSurfel>(surfels)};
}

TEST(TileCache, KeepsTilesOfItsMapOnly) {
  TileCache cache;
  cache.setMap("m");
  EXPECT_TRUE(cache.put(tile("m", 0, 1, 3)));
  EXPECT_FALSE(cache.put(tile("other", 1, 1, 3)));
  EXPECT_EQ(cache.surfels(), 3u);
}

TEST(TileCache, NewerReplacesOlderAndNotTheReverse) {
  TileCache cache;
  cache.setMap("m");
  EXPECT_TRUE(cache.put(tile("m", 0, 2, 3)));
  EXPECT_FALSE(cache.put(tile("m", 0, 1, 9)));
  EXPECT_FALSE(cache.put(tile("m", 0, 2, 9)));
  EXPECT_EQ(cache.surfels(), 3u);
  EXPECT_TRUE(cache.put(tile("m", 0, 3, 9)));
  EXPECT_EQ(cache.surfels(), 9u);
}

TEST(TileCache, RemovalIsRememberedSoThatItIsNotSentAgain) {
  TileCache cache;
  cache.setMap("m");
  cache.put(tile("m", 0, 1, 3));
  EXPECT_TRUE(cache.put(tile("m", 0, 2, 0)));
  EXPECT_TRUE(cache.tiles().empty());
  ASSERT_EQ(cache.held().size(), 1u);
  EXPECT_EQ(cache.held()[0].revision, 2u);
  EXPECT_FALSE(cache.put(tile("m", 0, 1, 3)));  // a late old one
  EXPECT_TRUE(cache.tiles().empty());
}

TEST(TileCache, AnotherMapEmptiesIt) {
  TileCache cache;
  cache.setMap("m");
  cache.put(tile("m", 0, 1, 3));
  cache.setMap("m");
  EXPECT_EQ(cache.tiles().size(), 1u);
  cache.setMap("n");
  EXPECT_TRUE(cache.tiles().empty());
  EXPECT_TRUE(cache.held().empty());
}

}  // namespace
}  // namespace comap
