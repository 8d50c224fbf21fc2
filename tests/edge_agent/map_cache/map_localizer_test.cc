// The localizer on an analytic room: what it believes while it walks, drifts, is carried off.
#include "edge_agent/map_cache/map_localizer.h"

#include <gtest/gtest.h>

#include "mapping_core/ferns/fern_encoder.h"
#include "tests/scenes/scene_noise.h"
#include "tests/scenes/scene_tiles.h"

namespace comap {
namespace {

constexpr int kFramesOfWalk = 30;

Pose standing(double x_m, double z_m, double yaw_rad) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0, z_m)};
}

// A walk along the front wall of the room, and one in its other half, which looks the other way.
Pose walk(int i) { return standing(-0.3 + 0.02 * i, -0.9, -0.1 + 0.008 * i); }
Pose otherWalk(int i) { return standing(0.4 - 0.02 * i, 0.5, M_PI - 0.1 + 0.008 * i); }

class MapLocalizerTest : public testing::Test {
 protected:
  struct Seen {
    Pyramid pyramid;
    FernCode code;
  };

  Seen see(const Scene& scene, const Pose& T_world_cam) {
    Frame frame = scene.render(smallCamera(), T_world_cam);
    addKinectNoise(frame, ++noise_);
    Seen seen;
    buildPyramid(frame.colour, frame.depth, frame.camera, 3, 0.3f, 6, seen.pyramid);
    seen.pyramid.insert(seen.pyramid.begin(), PyramidLevel{});
    seen.code = encodeFerns(book_, frame.colour, frame.depth);
    return seen;
  }

  // The core says where the robot is, and sends what was seen along both walks.
  void place(MapLocalizer& localizer, const Pose& T_map_odom, const std::vector<Pose>& views) {
    localizer.keyframeMade(0, "r-1-0");
    localizer.correct({"r", 1, "m", T_map_odom, 1}, 0);
    for (Tile& tile : sceneTiles(scene_, views, "m")) ASSERT_TRUE(localizer.put(std::move(tile)));
  }

  static std::vector<Pose> both() {
    std::vector<Pose> views;
    for (int i = 0; i < kFramesOfWalk; i += 6) views.insert(views.end(), {walk(i), otherWalk(i)});
    return views;
  }

  static std::string reasons(const MapLocalizer& localizer) {
    std::string all;
    for (const auto& [reason, count] : localizer.statistics().refused)
      all += reason + " " + std::to_string(count) + " ";
    return all;
  }

  double error_m(const MapLocalizer& localizer, const Pose& T_world_cam) {
    const LivePose live = localizer.live();
    const Pose T_map_cam = live.hypothesis ? live.hypothesis->T_map_cam : live.T_map_cam_exact;
    return (T_world_cam.inverse() * T_map_cam).translation().norm();
  }

  Scene scene_ = Scene::room();
  FernBook book_ = FernBook::standard();
  uint64_t noise_ = 0;
};

// An odometry that is wrong by 2 % of the way and turns away slowly.
Pose drifted(int i) {
  Vector6d twist = Vector6d::Zero();
  twist << 0.0016 * i, 0, 0.0008 * i, 0, 0.001 * i, 0;
  return walk(0).inverse() * walk(i) * Pose::exp(twist);
}

TEST_F(MapLocalizerTest, DriftIsBoundedWhereTheMapIsKnown) {
  for (const bool enabled : {true, false}) {
    LocalizerOptions options;
    options.enabled = enabled;
    MapLocalizer localizer(options);
    place(localizer, walk(0), both());
    for (int i = 0; i < kFramesOfWalk; ++i) localizer.track(see(scene_, walk(i)).pyramid, drifted(i), true);
    const double error = error_m(localizer, walk(kFramesOfWalk - 1));
    if (enabled) {
      EXPECT_LT(error, 0.02);
      EXPECT_GE(localizer.statistics().registered, 5u);
      EXPECT_EQ(localizer.live().state, MapState::kPlaced);
    } else {
      EXPECT_GT(error, 0.04) << "the drift itself";
      EXPECT_EQ(localizer.statistics().attempts, 0u);
    }
  }
}

TEST_F(MapLocalizerTest, WhatConsumersSeeDoesNotJump) {
  MapLocalizer localizer(LocalizerOptions{});
  place(localizer, walk(0), both());
  Pose T_before;
  for (int i = 0; i < kFramesOfWalk; ++i) {
    localizer.track(see(scene_, walk(i)).pyramid, drifted(2 * i), true);
    const Pose T_odom = drifted(2 * i);
    const Pose T_map_odom = localizer.live().T_map_cam * T_odom.inverse();
    if (i > 0) {
      EXPECT_LT((T_before.inverse() * T_map_odom).translation().norm(), 0.015) << i;
    }
    T_before = T_map_odom;
    if (i == kFramesOfWalk / 2) localizer.correct({"r", 1, "m", walk(0) * standing(0.05, 0, 0.01), 2}, 0);
  }
}

TEST_F(MapLocalizerTest, ACarriedOffRobotFindsItselfWhereOnlyOthersHaveBeen) {
  MapLocalizer localizer(LocalizerOptions{});
  place(localizer, walk(0), both());
  for (int i = 0; i < 10; ++i) localizer.track(see(scene_, walk(i)).pyramid, walk(0).inverse() * walk(i), true);
  ASSERT_EQ(localizer.live().state, MapState::kPlaced);
  // A new chain begins in the other half of the room; the odometry goes on from where it was.
  const Pose T_odom_away = walk(0).inverse() * walk(9);
  localizer.track(see(scene_, otherWalk(5)).pyramid, T_odom_away, false);
  localizer.keyframeMade(3, "r-1-3");
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  localizer.correct({"r", 1, "r-1-3", T_odom_away.inverse(), 2}, 4);
  EXPECT_EQ(localizer.live().map, "r-1-3") << "all that is known";
  EXPECT_FALSE(localizer.tiles().tiles().empty()) << "yet the map is kept";
  int found = -1;
  for (int i = 5; i < kFramesOfWalk && found < 0; ++i) {
    const Seen seen = see(scene_, otherWalk(i));
    const Pose T_odom_cam = T_odom_away * otherWalk(5).inverse() * otherWalk(i);
    ASSERT_TRUE(localizer.searches(false));
    if (localizer.search(seen.pyramid, seen.code, T_odom_cam)) found = i;
    localizer.track(seen.pyramid, T_odom_cam, true);
  }
  ASSERT_GE(found, 0);
  EXPECT_EQ(localizer.live().state, MapState::kRecognised);
  EXPECT_EQ(localizer.live().map, "r-1-3") << "until the core has said so";
  EXPECT_LT(error_m(localizer, otherWalk(found)), 0.02);
  ASSERT_TRUE(localizer.believed());
  EXPECT_EQ(localizer.believed()->map, "m");
  ASSERT_TRUE(localizer.interestAt());
  // A late word about the chain before is not about this one; the core's word that joins the chains is.
  localizer.correct({"r", 1, "m", walk(0), 3}, 3);
  EXPECT_EQ(localizer.live().state, MapState::kRecognised);
  const Pose T_map_odom = otherWalk(5) * T_odom_away.inverse();
  localizer.correct({"r", 1, "m", T_map_odom, 4}, 5);
  EXPECT_EQ(localizer.live().state, MapState::kPlaced);
  EXPECT_LT(error_m(localizer, otherWalk(found)), 0.02);
  EXPECT_FALSE(localizer.believed());
  EXPECT_FALSE(localizer.interestAt());
}

TEST_F(MapLocalizerTest, ARoomThatOnlyLooksSimilarIsNotBelieved) {
  const Scene other = Scene::room(2);
  MapLocalizer localizer(LocalizerOptions{});
  place(localizer, walk(0), both());
  localizer.track(see(scene_, walk(0)).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  for (int i = 0; i < 24; ++i) {
    const Seen seen = see(other, otherWalk(i));
    EXPECT_FALSE(localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i)));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  EXPECT_GE(localizer.statistics().searched, 8u);
}

TEST_F(MapLocalizerTest, TwoPlacesThatBothFitAreBothRefused) {
  MapLocalizer localizer(LocalizerOptions{});
  place(localizer, walk(0), both());
  // The same room once more, 20 m further on.
  for (Tile& tile : sceneTiles(scene_, both(), "m")) {
    tile.key.x += 40;
    for (TilePlace& at : tile.places)
      at.T_map_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(20, 0, 0)) * at.T_map_cam;
    ASSERT_TRUE(localizer.put(std::move(tile)));
  }
  localizer.track(see(scene_, walk(0)).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  for (int i = 0; i < 16; ++i) {
    const Seen seen = see(scene_, otherWalk(i));
    EXPECT_FALSE(localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i)));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
}

TEST_F(MapLocalizerTest, ARecognisedPlaceThatTurnsOutToBeAnotherIsTakenBack) {
  const Scene other = Scene::room(2);
  MapLocalizer localizer(LocalizerOptions{});
  place(localizer, walk(0), both());
  localizer.track(see(scene_, walk(0)).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  int i = 0;
  for (; i < 40 && localizer.live().state == MapState::kAstray; ++i) {
    const Seen seen = see(scene_, otherWalk(i));
    (void)localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  ASSERT_EQ(localizer.live().state, MapState::kRecognised);
  for (const int end = i + 28; i < end; ++i)
    localizer.track(see(other, otherWalk(i)).pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  EXPECT_EQ(localizer.statistics().taken_back, 1u) << reasons(localizer);
}

TEST_F(MapLocalizerTest, AfterLongEnoughOnANewChainTheOldMapIsGivenUp) {
  LocalizerOptions options;
  options.astray_keyframes = 5;
  MapLocalizer localizer(options);
  place(localizer, walk(0), both());
  localizer.track(see(scene_, walk(0)).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  localizer.correct({"r", 1, "r-1-1", Pose(), 2}, 2);
  for (uint32_t k = 2; k < 6; ++k) localizer.keyframeMade(k, "");
  EXPECT_EQ(localizer.tiles().map(), "m");
  localizer.keyframeMade(6, "");
  EXPECT_EQ(localizer.tiles().map(), "r-1-1");
  EXPECT_EQ(localizer.live().state, MapState::kPlaced);
  EXPECT_TRUE(localizer.tiles().tiles().empty());
}

}  // namespace
}  // namespace comap
