// An observer comes to hold a map that is larger than its questions, and each tile is sent once.
#include "fleet_tools/view/tile_asking.h"

#include <gtest/gtest.h>

#include "mapping_core/tiles/tile_index.h"

namespace comap {
namespace {

std::vector<Tile> gridOf(int side, int height) {
  std::vector<Tile> tiles;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < height; ++z) {
        Tile tile;
        tile.key = {"m", x - side / 3, y, z};
        tile.surfels.resize(3);
        tiles.push_back(std::move(tile));
      }
  return tiles;
}

// Holds what the core sends, until it has all of it or has asked so often. Returns how many tiles were sent.
size_t askUntilAll(TileAsking& asking, const TileIndex& core, size_t all, std::map<TileKey, Tile>& held, size_t most,
                   size_t questions) {
  constexpr size_t kBudget = 37;  // tiles
  size_t sent = 0;
  for (; questions > 0 && held.size() < all; --questions) {
    const TileAsking::Question question = asking.next(held, {1, 2, 3});
    EXPECT_LE(question.held.size(), most);
    auto due =
        core.lacking("m", Pose(Eigen::Quaterniond::Identity(), question.centre_m), question.radius_m, question.held);
    if (due.size() > kBudget) due.resize(kBudget);
    for (const TileDue& tile : due) {
      ++sent;
      asking.took(tile.key, tile.revision);
      held[tile.key] = *core.find(tile.key);
    }
  }
  return sent;
}

TEST(TileAsking, AMapLargerThanAQuestionComesWhole) {
  constexpr size_t kMost = 200;
  TileIndex core(1);
  const std::vector<Tile> tiles = gridOf(24, 4);
  core.update("m", tiles);
  TileAsking asking(kMost);
  std::map<TileKey, Tile> held;
  const size_t sent = askUntilAll(asking, core, tiles.size(), held, kMost, 3000);
  EXPECT_EQ(held.size(), tiles.size());
  EXPECT_EQ(sent, tiles.size()) << "none came twice: what lies in the region asked about is named";
}

TEST(TileAsking, ASmallMapIsAskedForAtOnce) {
  TileIndex core(1);
  const std::vector<Tile> tiles = gridOf(4, 2);
  core.update("m", tiles);
  TileAsking asking;
  std::map<TileKey, Tile> held;
  EXPECT_EQ(askUntilAll(asking, core, tiles.size(), held, 32768, 10), tiles.size());
  const auto question = asking.next(held, {1, 2, 3});
  EXPECT_EQ(question.held.size(), tiles.size());
  EXPECT_EQ(question.centre_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_GE(question.radius_m, 1e4);
}

}  // namespace
}  // namespace comap
