#include "edge_agent/map_cache/tile_cache.h"

#include <gtest/gtest.h>

#include <fstream>

#include "protocol/codec/codec.h"
#include "tests/files/temporary_folder.h"

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

class TileCacheOnDisk : public testing::Test {
 protected:
  TileCache start(size_t most_bytes = size_t{64} << 20) {
    TileCache cache(most_bytes);
    const auto log = [this](const std::string& line) { log_ += line + "\n"; };
    auto store = openTileStore(path_, kQuota, log);
    EXPECT_TRUE(store) << store.error().text;
    cache.keep({std::move(*store), kQuota, log});
    return cache;
  }
  static bool put(TileCache& cache, const Tile& tile) { return cache.put(tile, *encodeTile(tile)); }
  static std::map<TileKey, uint64_t> heldBy(const TileCache& cache) {
    std::map<TileKey, uint64_t> held;
    for (const HeldTile& one : cache.held()) held[one.key] = one.revision;
    return held;
  }

  static constexpr uint64_t kQuota = 50'000'000;
  TemporaryFolder folder_;
  const std::string path_ = folder_.path("a.tiles");
  std::string log_;
};

TEST_F(TileCacheOnDisk, AfterARestartItHoldsWhatIsInReachAndNamesIt) {
  {
    TileCache cache = start();
    cache.setMap("a-1-0");
    for (int x = 0; x < 40; ++x) EXPECT_TRUE(put(cache, tile("a-1-0", x, 7, 10)));
    EXPECT_TRUE(put(cache, tile("a-1-0", 3, 8, 0))) << "removed";
    cache.stayNear({0, 0, 0}, 100);
  }
  TileCache cache = start();
  cache.setMap("a-2-0");  // the map that the new start begins
  put(cache, tile("a-2-0", 0, 9, 5));
  cache.stayNear({0, 0, 0}, 5);
  EXPECT_EQ(cache.tiles().size(), 1u);
  cache.setMap("a-1-0");  // and is joined with the old one
  EXPECT_NE(log_.find("39 tiles of map a-1-0"), std::string::npos) << log_;
  cache.stayNear({0, 0, 0}, 5);
  EXPECT_EQ(cache.tiles().size(), 10u) << "within 5 m, less the removed one";
  EXPECT_EQ(cache.fromDisk(), 10u);
  EXPECT_EQ(heldBy(cache).size(), 10u) << "what is out of reach is not told";
  EXPECT_EQ(heldBy(cache).at({"a-1-0", 1, 0, 0}), 7u);
  cache.stayNear({10, 0, 0}, 5);
  EXPECT_TRUE(cache.tiles().contains({"a-1-0", 20, 0, 0}));
}

TEST_F(TileCacheOnDisk, WhatCannotBeReadAtOnceIsNamedAllTheSame) {
  constexpr size_t kLarge = 20'000;  // surfels; 320 kB in memory
  {
    TileCache cache = start();
    cache.setMap("m");
    for (int x = 0; x < 40; ++x) put(cache, tile("m", x, 7, kLarge));
    cache.stayNear({0, 0, 0}, 100);
  }
  TileCache cache = start();
  cache.setMap("m");
  cache.stayNear({0, 0, 0}, 100);
  EXPECT_LT(cache.tiles().size(), 40u);
  EXPECT_TRUE(cache.tiles().contains({"m", 0, 0, 0}));
  EXPECT_EQ(heldBy(cache).size(), 40u);
  for (int i = 0; i < 10; ++i) cache.stayNear({0, 0, 0}, 100);
  EXPECT_EQ(cache.tiles().size(), 40u);
  EXPECT_EQ(heldBy(cache).size(), 40u);
}

TEST_F(TileCacheOnDisk, ACoreWhoseStoreWasPutBackIsBelievedOnceAndThenOnlyNewerTiles) {
  {
    TileCache cache = start();
    cache.setMap("m");
    put(cache, tile("m", 0, 70, 10));
    cache.stayNear({0, 0, 0}, 5);
    EXPECT_FALSE(put(cache, tile("m", 0, 69, 3))) << "of the same start: overtaken";
  }
  TileCache cache = start();
  cache.setMap("m");
  EXPECT_FALSE(put(cache, tile("m", 0, 70, 10))) << "the same";
  EXPECT_TRUE(put(cache, tile("m", 0, 60, 3)));
  EXPECT_FALSE(put(cache, tile("m", 0, 59, 4)));
  cache.stayNear({0, 0, 0}, 5);
  EXPECT_EQ(cache.surfels(), 3u);
}

TEST_F(TileCacheOnDisk, WhatMemoryForgetsComesBackFromDisk) {
  TileCache cache = start(200'000);
  cache.setMap("m");
  for (int x = 0; x < 100; ++x) {  // 3.4 kB each
    put(cache, tile("m", x, 1, 200));
    cache.stayNear({0.5 * x, 0, 0}, 30);
  }
  EXPECT_FALSE(cache.tiles().contains({"m", 0, 0, 0}));
  EXPECT_LE(cache.bytes(), 200'000u);
  const size_t before = cache.fromDisk();
  for (int i = 0; i < 60; ++i) cache.stayNear({0, 0, 0}, 30);
  EXPECT_TRUE(cache.tiles().contains({"m", 0, 0, 0}));
  EXPECT_GT(cache.fromDisk(), before);
  EXPECT_LE(cache.bytes(), 200'000u);
}

TEST_F(TileCacheOnDisk, ADiskThatGoesBadIsLeftWithASentenceAndTheTilesComeAgain) {
  {
    TileCache cache = start();
    cache.setMap("m");
    for (int x = 0; x < 20; ++x) put(cache, tile("m", x, 7, 1000));
    cache.stayNear({0, 0, 0}, 100);
  }
  std::string bytes = contentOf(path_);
  for (size_t i = bytes.size() / 2; i < bytes.size(); ++i) bytes[i] = 'x';
  std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
  TileCache cache = start();
  cache.setMap("m");
  for (int i = 0; i < 5; ++i) cache.stayNear({0, 0, 0}, 100);
  EXPECT_NE(log_.find("dropped"), std::string::npos) << log_;
  for (const auto& [key, revision] : heldBy(cache)) EXPECT_TRUE(cache.tiles().contains(key));
  for (int x = 0; x < 20; ++x) put(cache, tile("m", x, 8, 1000));
  cache.stayNear({0, 0, 0}, 100);
  EXPECT_EQ(cache.tiles().size(), 20u);
}

}  // namespace
}  // namespace comap
