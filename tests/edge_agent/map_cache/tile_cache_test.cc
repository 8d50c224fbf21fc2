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

TEST(TileCache, HoldsNoMoreThanItMayAndKeepsWhatIsNear) {
  constexpr size_t kMost = 200'000;
  TileCache cache(kMost);
  cache.setMap("m");
  for (int x = 0; x < 100; ++x) {
    cache.put(tile("m", x, 1, 1000));  // 14 kB each
    cache.stayNear(Eigen::Vector3d(0.5 * x, 0, 0), 10);
    ASSERT_LE(cache.bytes(), kMost);
  }
  EXPECT_GT(cache.forgotten(), 80u);
  EXPECT_TRUE(cache.tiles().contains({"m", 99, 0, 0}));
  EXPECT_FALSE(cache.tiles().contains({"m", 50, 0, 0}));
  size_t surfels = 0;
  for (const auto& [key, held] : cache.tiles()) surfels += held->surfels.size();
  EXPECT_EQ(cache.surfels(), surfels);
}

TEST(TileCache, WhatWasForgottenIsNotHeldAndIsTakenAgainWhenTheRobotComesBack) {
  TileCache cache(100'000);
  cache.setMap("m");
  for (int x = 0; x < 20; ++x) {
    cache.put(tile("m", x, 5, 1000));
    cache.stayNear(Eigen::Vector3d(0.5 * x, 0, 0), 10);
  }
  const TileKey first{"m", 0, 0, 0};
  for (const HeldTile& held : cache.held()) EXPECT_NE(held.key, first);
  cache.stayNear(Eigen::Vector3d::Zero(), 10);
  EXPECT_TRUE(cache.put(tile("m", 0, 5, 1000))) << "the same revision as before";
  cache.stayNear(Eigen::Vector3d::Zero(), 10);
  EXPECT_TRUE(cache.tiles().contains(first));
}

TEST(TileCache, WhatItCannotHoldItDoesNotAskForAtOnceButLater) {
  TileCache cache(100'000);
  cache.setMap("m");
  const Eigen::Vector3d here(0.25, 0.25, 0.25);
  cache.stayNear(here, 10);
  EXPECT_EQ(cache.reach_m(), 10);
  for (int x = 0; x < 20; ++x) cache.put(tile("m", x, 1, 1000));
  cache.stayNear(here, 10);
  EXPECT_LT(cache.reach_m(), 4);
  EXPECT_GT(cache.reach_m(), 1);
  // What the core sends for that reach stays: nothing goes back and forth.
  for (int round = 0; round < 20; ++round) {
    const size_t forgotten = cache.forgotten();
    for (int x = 0; x < 20; ++x)
      if (0.5 * x - 0.25 <= cache.reach_m() && !cache.tiles().contains({"m", x, 0, 0}))
        cache.put(tile("m", x, 1, 1000));
    cache.stayNear(here, 10);
    EXPECT_EQ(cache.forgotten(), forgotten) << round;
  }
  // Tiles become small: there is room again.
  for (int x = 0; x < 20; ++x) cache.put(tile("m", x, 2, 1));
  for (int i = 0; i < 20; ++i) cache.stayNear(here, 10);
  EXPECT_EQ(cache.reach_m(), 10);
}

TEST(TileCache, RememberedRemovalsAreBoundedToo) {
  TileCache cache;
  cache.setMap("m");
  for (int x = 0; x < 40000; ++x) cache.put(tile("m", x, 1, 0));
  cache.stayNear(Eigen::Vector3d::Zero(), 10);
  EXPECT_LE(cache.held().size(), TileCache::kMostEntries);
  EXPECT_EQ(cache.held().front().key.x, 0);
}

}  // namespace
}  // namespace comap
