#include "edge_agent/map_cache/tile_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/types/tile_quantisation.h"
#include "tests/scenes/scene_tiles.h"

namespace comap {
namespace {

Pose lookingFrom(double x_m, double z_m, double yaw_rad) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0, z_m)};
}

class TileViewTest : public testing::Test {
 protected:
  void hold(const std::vector<Pose>& T_world_cams) {
    cache_.setMap("m");
    for (Tile& tile : sceneTiles(scene_, T_world_cams, "m")) ASSERT_TRUE(cache_.put(std::move(tile)));
  }

  Scene scene_ = Scene::room();
  TileCache cache_;
  TileRenderer renderer_{TileViewOptions{}};
};

TEST_F(TileViewTest, ShowsWhatACameraThereWouldSee) {
  hold({lookingFrom(0, 0, 0), lookingFrom(0.3, 0.1, 0.15), lookingFrom(-0.3, 0, -0.15)});
  const Pose T_world_cam = lookingFrom(0.1, 0.1, 0.05);
  const CameraModel camera = smallCamera();
  const TileView& view = renderer_.render(cache_, camera, T_world_cam);
  const Frame truth = scene_.render(camera, T_world_cam);
  EXPECT_GT(view.filled, 0.9);
  size_t compared = 0, near = 0, alike = 0;
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    const double z = truth.depth.data()[i] / kDepthUnitsPerMetre;
    if (view.depth_m.data()[i] <= 0 || z <= 0) continue;
    ++compared;
    near += std::abs(view.depth_m.data()[i] - z) < 0.003;
    alike += std::abs(int{view.colour.data()[i].g} - int{truth.colour.data()[i].g}) < 12;
  }
  EXPECT_GT(near, compared * 93 / 100);
  EXPECT_GT(alike, compared * 90 / 100);
}

TEST_F(TileViewTest, DoesNotShowSurfacesFromBehindNorThroughOthers) {
  cache_.setMap("m");
  // Two walls ahead, the nearer one facing away from the camera, then turned round.
  for (const bool facing : {false, true}) {
    std::vector<TileSurfel> wall;
    const TileKey near_key{"m", 0, 0, 2}, far_key{"m", 0, 0, 4};
    const auto fill = [&](const TileKey& key, float z, float nz, uint8_t grey) {
      Tile tile{key, facing ? 2u : 1u};
      for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 50; ++x) {
          TileSurfel surfel;
          quantiseDisc(
              {{0.01f * static_cast<float>(x) + 0.005f, 0.01f * static_cast<float>(y) + 0.005f, z}, {0, 0, nz}, 0.006f},
              key, surfel);
          surfel.r = surfel.g = surfel.b = grey;
          tile.surfels.push_back(surfel);
        }
      ASSERT_TRUE(cache_.put(std::move(tile)));
    };
    fill(near_key, 1.2f, facing ? -1.0f : 1.0f, 50);
    fill(far_key, 2.2f, -1.0f, 200);
    const TileView& view =
        renderer_.render(cache_, smallCamera(), Pose(Eigen::Quaterniond::Identity(), {0.25, 0.25, 0}));
    EXPECT_NEAR(view.depth_m.at(160, 120), facing ? 1.2 : 2.2, 1e-3);
    EXPECT_EQ(view.colour.at(160, 120).r, facing ? 50 : 200);
    EXPECT_EQ(view.depth_m.at(3, 3), 0) << "nothing is there";
  }
}

TEST_F(TileViewTest, IsTheSameFarFromTheMapsOrigin) {
  hold({lookingFrom(0, 0, 0)});
  const TileView here = renderer_.render(cache_, smallCamera(), Pose());
  TileCache far;
  far.setMap("m");
  for (const auto& [key, tile] : cache_.tiles()) {
    Tile moved = *tile;
    moved.key = {"m", key.x + 2000000, key.y, key.z};
    ASSERT_TRUE(far.put(std::move(moved)));
  }
  const TileView& there = renderer_.render(far, smallCamera(), Pose(Eigen::Quaterniond::Identity(), {1e6, 0, 0}));
  size_t near = 0;
  for (size_t i = 0; i < here.depth_m.size(); ++i)
    near += std::abs(here.depth_m.data()[i] - there.depth_m.data()[i]) < 1e-4f;
  EXPECT_GT(near, here.depth_m.size() * 99 / 100);
}

TEST_F(TileViewTest, WithoutTilesIsEmpty) {
  const TileView& view = renderer_.render(cache_, smallCamera(), Pose());
  EXPECT_EQ(view.filled, 0);
  EXPECT_EQ(view.surfels, 0u);
}

}  // namespace
}  // namespace comap
