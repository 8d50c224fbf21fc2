#include "mapping_core/tiles/tile_index.h"

#include <gtest/gtest.h>

#include <random>

namespace comap {
namespace {

Tile tileAt(int x, int y, int z, size_t surfels, uint8_t shade = 0) {
  Tile tile;
  tile.key = {"m", x, y, z};
  tile.surfels.resize(surfels);
  for (size_t i = 0; i < surfels; ++i) {
    tile.surfels[i].x = uint16_t(i);
    tile.surfels[i].r = shade;
  }
  return tile;
}

// What goes to a robot, in this order.
std::vector<Tile> lacking(const TileIndex& index, const Pose& T_map_cam, double radius_m,
                          const std::vector<HeldTile>& held) {
  std::vector<Tile> tiles;
  for (const TileDue& due : index.lacking("m", T_map_cam, radius_m, held)) {
    const Tile* tile = index.find(due.key);
    EXPECT_EQ(tile == nullptr, due.removal);
    tiles.push_back(tile == nullptr ? Tile{due.key, due.revision} : *tile);
    EXPECT_EQ(tiles.back().revision, due.revision);
  }
  return tiles;
}

// A camera that looks along z.
Pose at(const Eigen::Vector3d& position_m) { return Pose(Eigen::Quaterniond::Identity(), position_m); }
Pose at(double x, double y, double z) { return at(Eigen::Vector3d(x, y, z)); }

TEST(TileIndex, onlyWhatChangedGetsANewRevision) {
  TileIndex index;
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5)}), 2u);
  EXPECT_EQ(index.revision(), 2u);
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5)}), 0u);
  EXPECT_EQ(index.revision(), 2u);
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5, 7)}), 1u);
  ASSERT_EQ(index.tiles("m").size(), 2u);
  EXPECT_EQ(index.tiles("m")[0].revision, 2u);
  EXPECT_EQ(index.tiles("m")[1].revision, 4u);
}

TEST(TileIndex, aTileThatGoesIsToldToThoseWhoHoldIt) {
  TileIndex index;
  index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5)});
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5)}), 1u);
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5)}), 0u) << "a removal is one change";
  EXPECT_EQ(index.tiles("m").size(), 1u);
  const std::vector<HeldTile> held = {{{"m", 0, 0, 0}, 2}, {{"m", 1, 0, 0}, 2}};
  const auto told = lacking(index, at(50, 50, 50), 1, held);
  ASSERT_EQ(told.size(), 1u) << "however far away";
  EXPECT_EQ(told[0].key.x, 1);
  EXPECT_TRUE(told[0].surfels.empty());
  EXPECT_EQ(told[0].revision, 4u);
  const std::vector<HeldTile> knows = {{{"m", 0, 0, 0}, 2}, {{"m", 1, 0, 0}, 4}};
  EXPECT_TRUE(lacking(index, at(50, 50, 50), 1, knows).empty()) << "who names the removal knows it";
  EXPECT_TRUE(lacking(index, at(0.5, 0, 0), 3, std::vector<HeldTile>{held[0]}).empty())
      << "who never held it need not know";
  EXPECT_EQ(index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5)}), 1u) << "and it may come back";
}

TEST(TileIndex, whatIsAheadComesBeforeWhatIsBehind) {
  TileIndex index;
  index.update("m", {tileAt(0, 0, 5, 5), tileAt(0, 0, -4, 5), tileAt(0, 0, -2, 5), tileAt(0, 0, 12, 5)});
  const auto sent = lacking(index, at(0.25, 0.25, 0.25), 20, {});
  ASSERT_EQ(sent.size(), 4u);
  EXPECT_EQ(sent[0].key.z, -2) << "1 m behind, before 2.5 m ahead";
  EXPECT_EQ(sent[1].key.z, 5);
  EXPECT_EQ(sent[2].key.z, -4) << "2 m behind, after 2.5 m ahead";
  EXPECT_EQ(sent[3].key.z, 12);
}

TEST(TileIndex, nearestFirstWithinRadius) {
  TileIndex index;
  std::vector<Tile> tiles;
  for (int x = 0; x < 20; ++x) tiles.push_back(tileAt(x, 0, 0, 100));
  index.update("m", tiles);
  const Eigen::Vector3d here(2.6, 0.25, 0.25);  // in tile 5
  const auto all = lacking(index, at(here), 2.0, {});
  ASSERT_GE(all.size(), 7u);
  EXPECT_EQ(all[0].key.x, 5);
  for (size_t i = 1; i < all.size(); ++i) {
    EXPECT_LE(std::abs(all[i - 1].key.x + 0.5 - 5.2), std::abs(all[i].key.x + 0.5 - 5.2) + 1e-9);
  }
  for (const Tile& tile : all) EXPECT_LE(tile.key.x, 9) << "tile 9 begins 1.9 m away, tile 10 2.4 m";
}

TEST(TileIndex, NewsDoNotWaitForAllThatIsNearAndWhatIsNearDoesNotWaitForNews) {
  TileIndex index;
  std::vector<Tile> tiles, far;
  for (int x = 0; x < 400; ++x) tiles.push_back(tileAt(x, 0, 0, 5));
  index.update("m", tiles);
  for (int x = 300; x < 400; ++x) far.push_back(tileAt(x, 0, 0, 5, 9));
  EXPECT_EQ(index.change("m", far), 100u);
  const auto sent = lacking(index, at(0, 0, 0), 1000, {});
  ASSERT_EQ(sent.size(), 400u);
  size_t news = 0, near = 0;
  for (size_t i = 0; i < 80; ++i) (sent[i].revision == 4 ? news : near) += 1;
  EXPECT_EQ(news, 20u);
  EXPECT_EQ(near, 60u);
  EXPECT_EQ(sent[0].key.x, 0);
  EXPECT_EQ(sent[1].key.x, 300) << "of the news the nearest first";
}

// Near the robot as much changes at any time as there is room for.
TEST(TileIndex, WhatIsFarDoesNotWaitForEver) {
  TileIndex index;
  index.update("m", {tileAt(200, 0, 0, 5), tileAt(-200, 0, 0, 5)});
  std::map<TileKey, uint64_t> cache = {{{"m", 200, 0, 0}, 0}};  // held in an old revision; the other never was
  for (int round = 0; cache.size() < 22 || cache.at({"m", 200, 0, 0}) == 0; ++round) {
    ASSERT_LT(round, 40);
    std::vector<Tile> near;
    for (int x = 0; x < 20; ++x) near.push_back(tileAt(x, 0, 0, 5, static_cast<uint8_t>(round)));
    ASSERT_EQ(index.change("m", near), 20u);
    std::vector<HeldTile> held;
    for (const auto& [key, revision] : cache) held.push_back({key, revision});
    const auto sent = lacking(index, at(0, 0, 0), 1000, held);
    for (size_t i = 0; i < 10; ++i) cache[sent[i].key] = sent[i].revision;
  }
}

TEST(TileIndex, AChangeOfSomeTilesLeavesTheOthers) {
  TileIndex index;
  index.update("m", {tileAt(0, 0, 0, 5), tileAt(1, 0, 0, 5), tileAt(2, 0, 0, 5)});
  index.update("n", {tileAt(0, 0, 0, 5)});
  EXPECT_EQ(index.change("m", {tileAt(0, 0, 0, 5), tileAt(9, 0, 0, 0)}), 0u) << "as it was, and one that never was";
  EXPECT_EQ(index.revision(), 4u);
  EXPECT_EQ(index.change("m", {tileAt(0, 0, 0, 5, 1), tileAt(1, 0, 0, 0)}), 2u);
  const auto tiles = index.tiles("m");
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].revision, 6u);
  EXPECT_EQ(tiles[1].key.x, 2);
  EXPECT_EQ(tiles[1].revision, 2u);
  EXPECT_EQ(index.tiles("n").size(), 1u);
  EXPECT_EQ(std::distance(index.of("m").begin(), index.of("m").end()), 3) << "the removal too";
}

TEST(TileIndex, aDroppedMapLeavesNothingButWhatIsHeldIsWithdrawn) {
  TileIndex index;
  index.update("m", {tileAt(0, 0, 0, 5)});
  index.update("other", {tileAt(0, 0, 0, 6)});
  index.drop("m");
  EXPECT_TRUE(index.tiles("m").empty());
  EXPECT_EQ(index.tiles("other").size(), 1u);
  EXPECT_TRUE(lacking(index, at(0, 0, 0), 9, {}).empty());
  const auto told = lacking(index, at(0, 0, 0), 9, std::vector<HeldTile>{{{"m", 0, 0, 0}, 2}});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_TRUE(told[0].surfels.empty());
  index.update("m", {tileAt(0, 0, 0, 5)});
  EXPECT_GT(index.tiles("m")[0].revision, 2u) << "a revision is never used twice";
}

TEST(TileIndex, aRobotThatAppliesWhatItIsSentEndsWithTheMap) {
  std::mt19937 engine(1);
  std::uniform_int_distribution<int> at(-4, 4), size(1, 400), shade(0, 3), count(5, 60);
  TileIndex index;
  std::map<TileKey, Tile> cache;
  for (int round = 0; round < 60; ++round) {
    std::map<TileKey, Tile> map;
    for (int i = count(engine); i > 0; --i) {
      Tile tile = tileAt(at(engine), at(engine), 0, size_t(size(engine)), uint8_t(shade(engine)));
      map[tile.key] = tile;
    }
    std::vector<Tile> tiles;
    for (const auto& [key, tile] : map) tiles.push_back(tile);
    index.update("m", tiles);
    int messages = 0;
    for (;; ++messages) {
      ASSERT_LT(messages, 1000) << "never done";
      std::vector<HeldTile> held;
      for (const auto& [key, tile] : cache) held.push_back({key, tile.revision});
      const auto sent = lacking(index, Pose(), 100, held);
      if (sent.empty()) break;
      for (size_t i = 0; i < std::min<size_t>(sent.size(), 7); ++i) {  // a budget
        const Tile& tile = sent[i];
        if (tile.surfels.empty()) {
          EXPECT_EQ(cache.erase(tile.key), 1u);
        } else {
          cache[tile.key] = tile;
        }
      }
      if (round % 2 == 0 && messages == 1) break;  // the link breaks; the rest must come later
    }
    if (round % 2 == 0) continue;
    ASSERT_EQ(cache.size(), map.size());
    for (const auto& [key, tile] : map) ASSERT_EQ(cache.at(key).surfels, tile.surfels);
  }
}

TEST(TileIndex, ATileOfPlacesAloneIsNotARemoval) {
  TileIndex index;
  Tile tile;
  tile.key = {"m", 0, 0, 0};
  tile.places.push_back({Pose(), {7, std::vector<uint8_t>(500, 1)}});
  EXPECT_EQ(index.update("m", {tile}), 1u);
  EXPECT_EQ(index.update("m", {tile}), 0u) << "nothing has changed";
  EXPECT_TRUE(index.holds("m"));
  EXPECT_FALSE(index.holds("l"));
  const auto sent = lacking(index, at(0, 0, 0), 5, {});
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_FALSE(sent[0].empty());
  EXPECT_EQ(index.update("m", {}), 1u);
  const std::vector<HeldTile> held{{tile.key, sent[0].revision}};
  const auto removed = lacking(index, at(0, 0, 0), 5, held);
  ASSERT_EQ(removed.size(), 1u);
  EXPECT_TRUE(removed[0].empty());
}

}  // namespace
}  // namespace comap
