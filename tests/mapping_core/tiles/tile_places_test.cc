#include "mapping_core/tiles/tile_places.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TilePlace view(double x_m, double yaw_rad, uint8_t code = 1) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose(Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0.1, 0.1)), {7, std::vector<uint8_t>(500, code)}};
}

std::vector<Tile> placesOf(const std::vector<TilePlace>& views, const std::vector<Tile>& current = {}) {
  std::vector<Tile> tiles;
  addPlaces("m", views, current, PlaceOptions{}, tiles);
  return tiles;
}

TEST(TilePlaces, GoIntoTheCubeThatTheirCameraStandsIn) {
  std::vector<Tile> tiles(1);
  tiles[0].key = {"m", 1, 0, 0};
  tiles[0].surfels.resize(3);
  addPlaces("m", std::vector<TilePlace>{view(0.6, 0), view(-0.2, 0)}, {}, PlaceOptions{}, tiles);
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

TEST(TilePlaces, AreNoMoreThanTheMost) {
  PlaceOptions options;
  options.most_per_tile = 4;
  std::vector<TilePlace> views;
  for (int i = 0; i < 12; ++i) views.push_back(view(0.1, 0.5 * i));
  std::vector<Tile> tiles;
  addPlaces("m", views, {}, options, tiles);
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
