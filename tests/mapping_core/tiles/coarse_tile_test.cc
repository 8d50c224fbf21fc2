#include "mapping_core/tiles/coarse_tile.h"

#include <gtest/gtest.h>

#include <set>

#include "protocol/types/tile_quantisation.h"

namespace comap {
namespace {

// A wall across the tile, a surfel a centimetre; the one at each cube's middle is the surest.
Tile wall(int x, uint64_t revision) {
  Tile tile{{"m", x, 0, 0}, revision, {}, {}};
  for (uint32_t u = 0; u < 50; ++u)
    for (uint32_t v = 0; v < 50; ++v) {
      TileSurfel& s = tile.surfels.emplace_back();
      s.x = static_cast<uint16_t>((u * 2 + 1) * 65536 / 100);
      s.y = static_cast<uint16_t>((v * 2 + 1) * 65536 / 100);
      s.z = 30000;
      s.log_radius = 80;
      s.confidence = u % 5 == 2 && v % 5 == 2 ? 9 : 5;
    }
  tile.places.resize(1);
  return tile;
}

TEST(CoarseTile, KeepsTheSurestOfEachCubeAsLargeAsTheCube) {
  const Tile tile = wall(3, 8);
  const Tile coarse = coarsened(tile);
  EXPECT_EQ(coarse.key, tile.key);
  EXPECT_EQ(coarse.revision, 7u);
  EXPECT_EQ(coarse.places, tile.places);
  ASSERT_EQ(coarse.surfels.size(), 100u);
  std::set<std::pair<int, int>> cubes;
  for (const TileSurfel& s : coarse.surfels) {
    EXPECT_EQ(s.confidence, 9);
    cubes.emplace(s.x * 10 / 65536, s.y * 10 / 65536);
    const float radius_m = dequantiseDisc(s, tile.key).radius_m;
    EXPECT_GT(radius_m, 0.05f * 0.707f) << "no gap where four cubes meet";
    EXPECT_LT(radius_m, 0.05f);
  }
  EXPECT_EQ(cubes.size(), 100u);
}

TEST(CoarseTile, ADiscThatIsLargerStaysAsItIs) {
  Tile tile = wall(0, 8);
  for (TileSurfel& s : tile.surfels) s.log_radius = 200;
  for (const TileSurfel& s : coarsened(tile).surfels) EXPECT_EQ(s.log_radius, 200);
}

std::vector<Tile> walls(int count) {
  std::vector<Tile> tiles;
  for (int x = 0; x < count; ++x) tiles.push_back(wall(x, 0));
  return tiles;
}

std::vector<TileDue> dueOf(const TileIndex& index, const std::vector<HeldTile>& held) {
  return index.lacking("m", Pose(), 100, held);
}

TEST(CoarseTile, WhoHoldsNothingGetsCoarseFormsAmongTheOthersAndAllInFull) {
  TileIndex index;
  index.change("m", walls(40));
  const auto plain = dueOf(index, {});
  const auto all = withCoarse(index, plain, {});
  std::vector<TileDue> full;
  std::map<TileKey, size_t> coarse_at;
  size_t coarse_bytes = 0, full_bytes = 0, most_ahead = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    const Tile& tile = *index.find(all[i].key);
    if (all[i].coarse) {
      EXPECT_EQ(all[i].revision, tile.revision - 1);
      EXPECT_TRUE(coarse_at.emplace(all[i].key, i).second) << "once";
      coarse_bytes += roughBytes(coarsened(tile));
    } else {
      EXPECT_EQ(all[i].revision, tile.revision);
      full.push_back(all[i]);
      full_bytes += roughBytes(tile);
    }
    most_ahead = std::max(most_ahead, coarse_bytes > full_bytes ? coarse_bytes - full_bytes : 0);
  }
  ASSERT_EQ(full.size(), plain.size());
  for (size_t i = 0; i < full.size(); ++i) EXPECT_EQ(full[i].key, plain[i].key) << "in their order";
  EXPECT_EQ(coarse_at.size(), plain.size() - 1) << "all but the first, which goes in full at once";
  EXPECT_LE(most_ahead, 3 * roughBytes(wall(0, 0))) << "about half of the bytes";
  EXPECT_LT(coarse_at.rbegin()->second, all.size() / 2 + all.size() / 4) << "coarse ones come long before the end";
}

TEST(CoarseTile, WhoHoldsATileInFullOrItsCoarseFormOfNowGetsNone) {
  TileIndex index;
  index.change("m", walls(4));
  std::vector<Tile> changed = walls(4);
  for (Tile& tile : changed) tile.surfels.pop_back();
  index.change("m", std::move(changed));
  const uint64_t now = index.revision();
  const std::vector<HeldTile> held = {{{"m", 0, 0, 0}, now - 2},   // in full, of before: finer than coarse
                                      {{"m", 1, 0, 0}, now - 1},   // coarse, of now
                                      {{"m", 2, 0, 0}, now - 3}};  // coarse, of before
  std::set<int> coarse;
  for (const TileDue& due : withCoarse(index, dueOf(index, held), held))
    if (due.coarse) coarse.insert(due.key.x);
  EXPECT_FALSE(coarse.contains(0));
  EXPECT_FALSE(coarse.contains(1));
  EXPECT_TRUE(coarse.contains(2) || coarse.contains(3));
}

TEST(CoarseTile, SmallTilesAndRemovalsHaveNone) {
  TileIndex index;
  std::vector<Tile> tiles = walls(3);
  for (Tile& tile : tiles) tile.surfels.resize(50);
  index.change("m", tiles);
  tiles[0].surfels.clear();
  tiles[0].places.clear();
  index.change("m", {tiles[0]});
  const std::vector<HeldTile> held = {{{"m", 0, 0, 0}, 2}};
  const auto all = withCoarse(index, dueOf(index, held), held);
  EXPECT_EQ(all.size(), 3u);
  for (const TileDue& due : all) EXPECT_FALSE(due.coarse);
}

}  // namespace
}  // namespace comap
