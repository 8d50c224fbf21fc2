#include "mapping_core/tiles/tile_places.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TilePlace view(double x_m, double yaw_rad, uint8_t code = 1) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose(Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0.1, 0.1)), {7, std::vector<uint8_t>(500, code)}};
}

// The tiles of an index that gets the places of these views after those of earlier ones.
std::vector<Tile> placesOf(const std::vector<TilePlace>& views, const std::vector<Tile>& before = {}) {
  TileIndex index;
  index.update("m", before);
  std::vector<Tile> tiles;
  addPlaces("m", views, index, PlaceOptions{}, tiles);
  index.change("m", std::move(tiles));
  return index.tiles("m");
}

TEST(TilePlaces, GoIntoTheCubeThatTheirCameraStandsIn) {
  std::vector<Tile> tiles(1);
  tiles[0].key = {"m", 1, 0, 0};
  tiles[0].surfels.resize(3);
  addPlaces("m", std::vector<TilePlace>{view(0.6, 0), view(-0.2, 0)}, TileIndex(), PlaceOptions{}, tiles);
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].places.size(), 1u);
  EXPECT_EQ(tiles[0].surfels.size(), 3u);
  EXPECT_EQ(tiles[1].key, (TileKey{"m", -1, 0, 0}));
  EXPECT_EQ(tiles[1].places.size(), 1u);
}

TEST(TilePlaces, OfViewsThatAreAlikeOneIsEnough) {
  const auto tiles = placesOf({view(0.1, 0), view(0.15, 0.1), view(0.2, 1.0), view(0.4, 0)});
  ASSERT_EQ(tiles.size(), 1u);
  ASSERT_EQ(tiles[0].places.size(), 3u) << "the second looks the same way from nearly the same point";
  EXPECT_EQ(tiles[0].places[0], view(0.1, 0));
}

TEST(TilePlaces, AViewThatTheGraphStirsKeepsItsPoseAndOneThatItMovesDoesNot) {
  const auto before = placesOf({view(0.1, 0)});
  EXPECT_EQ(placesOf({view(0.11, 0)}, before)[0].places, before[0].places);
  EXPECT_EQ(placesOf({view(0.15, 0)}, before)[0].places[0], view(0.15, 0));
  EXPECT_EQ(placesOf({view(0.11, 0, 2)}, before)[0].places[0], view(0.11, 0, 2)) << "of another keyframe";
}

TEST(TilePlaces, OfTilesThatHaveNotChangedOnlyThoseWithOtherPlacesAreAdded) {
  TileIndex index;
  std::vector<Tile> tiles(3);
  for (int x = 0; x < 3; ++x) {
    tiles[static_cast<size_t>(x)].key = {"m", x, 0, 0};
    tiles[static_cast<size_t>(x)].surfels.resize(static_cast<size_t>(x) + 1);
  }
  std::vector<TilePlace> views = {view(0.1, 0), view(0.6, 0)};
  addPlaces("m", views, index, PlaceOptions{}, tiles);
  ASSERT_EQ(index.change("m", tiles), 3u);

  tiles.clear();
  addPlaces("m", views, index, PlaceOptions{}, tiles);
  EXPECT_TRUE(tiles.empty());
  views[0] = view(1.2, 0);  // one cube loses its only place, another gets its first
  addPlaces("m", views, index, PlaceOptions{}, tiles);
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].key.x, 0);
  EXPECT_EQ(tiles[0].surfels.size(), 1u);
  EXPECT_TRUE(tiles[0].places.empty());
  EXPECT_EQ(tiles[1].key.x, 2);
  EXPECT_EQ(tiles[1].surfels.size(), 3u);
  EXPECT_EQ(tiles[1].places.size(), 1u);

  std::vector<Tile> gone(1);  // of surfels; the place stays
  gone[0].key = {"m", 1, 0, 0};
  addPlaces("m", std::vector<TilePlace>{view(0.6, 0)}, index, PlaceOptions{}, gone);
  EXPECT_TRUE(gone[0].surfels.empty());
  EXPECT_EQ(gone[0].places.size(), 1u);
}

TEST(TilePlaces, AreNoMoreThanTheMost) {
  PlaceOptions options;
  options.most_per_tile = 4;
  std::vector<TilePlace> views;
  for (int i = 0; i < 12; ++i) views.push_back(view(0.1, 0.5 * i));
  std::vector<Tile> tiles;
  addPlaces("m", views, TileIndex(), options, tiles);
  ASSERT_EQ(tiles.size(), 1u);
  EXPECT_EQ(tiles[0].places.size(), 4u);
}

TEST(TilePlaces, WithoutACodeOrFarBeyondAnyMapAreLeftOut) {
  TilePlace without = view(0.1, 0);
  without.code.codes.clear();
  EXPECT_TRUE(placesOf({without, view(1e9, 0)}).empty());
}

}  // namespace
}  // namespace comap
