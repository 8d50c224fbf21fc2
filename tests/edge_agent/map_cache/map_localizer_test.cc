// The localizer on an analytic room: what it believes while it walks, drifts, is carried off.
#include "edge_agent/map_cache/map_localizer.h"

#include <gtest/gtest.h>

#include <map>
#include <tuple>
#include <vector>

#include "mapping_core/ferns/fern_encoder.h"
#include "tests/scenes/scene_noise.h"
#include "tests/scenes/scene_tiles.h"

namespace comap {
namespace {

constexpr int kFramesOfWalk = 12;
constexpr uint64_t kRoom = 1, kOtherRoom = 2;

Pose standing(double x_m, double z_m, double yaw_rad) {
  Vector6d twist = Vector6d::Zero();
  twist[4] = yaw_rad;
  return {Pose::exp(twist).rotation(), Eigen::Vector3d(x_m, 0, z_m)};
}

// A walk along the front wall of the room, and one in its other half, which looks the other way.
Pose walk(int i) { return standing(-0.3 + 0.05 * i, -0.9, -0.1 + 0.02 * i); }
Pose otherWalk(int i) { return standing(0.4 - 0.05 * i, 0.5, M_PI - 0.1 + 0.02 * i); }

class MapLocalizerTest : public testing::Test {
 protected:
  struct Seen {
    Pyramid pyramid;
    FernCode code;
  };

  // Pictures and tiles are the same in all tests, and the slowest of all to make.
  static const Seen& see(uint64_t room, bool other_walk, int i) {
    static std::map<std::tuple<uint64_t, bool, int>, Seen> made;
    const auto [at, is_new] = made.try_emplace({room, other_walk, i});
    if (is_new) {
      static const FernBook kBook = FernBook::standard();
      Frame frame = Scene::room(room).render(smallCamera(), other_walk ? otherWalk(i) : walk(i));
      addKinectNoise(frame, 1 + 1000 * room + 100 * other_walk + i);
      buildPyramid(frame.colour, frame.depth, frame.camera, 3, 0.3f, 6, at->second.pyramid);
      at->second.pyramid.insert(at->second.pyramid.begin(), PyramidLevel{});
      at->second.code = encodeFerns(kBook, frame.colour, frame.depth);
    }
    return at->second;
  }
  static const Seen& onWalk(int i) { return see(kRoom, false, i); }
  static const Seen& onOtherWalk(int i) { return see(kRoom, true, i); }

  // What was seen along both walks.
  static const std::vector<Tile>& tiles() {
    static const std::vector<Tile> kTiles = [] {
      std::vector<Pose> views;
      for (int i = 0; i <= kFramesOfWalk; i += 4) views.insert(views.end(), {walk(i), otherWalk(i)});
      return sceneTiles(Scene::room(kRoom), views, "m");
    }();
    return kTiles;
  }

  // The core says where the robot is, and sends the tiles.
  void place(MapLocalizer& localizer, const Pose& T_map_odom) {
    localizer.keyframeMade(0, "r-1-0");
    localizer.correct({"r", 1, "m", T_map_odom, 1}, 0);
    for (const Tile& tile : tiles()) ASSERT_TRUE(localizer.put(tile));
  }

  // Registers and searches more often than by default, since these walks are of few frames.
  static LocalizerOptions often() {
    LocalizerOptions options;
    options.every_frames = 2;
    options.search_every_frames = 1;
    return options;
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
};

// An odometry that is wrong by 2 % of the way and turns away slowly.
Pose drifted(int i) {
  Vector6d twist = Vector6d::Zero();
  twist << 0.004 * i, 0, 0.002 * i, 0, 0.0025 * i, 0;
  return walk(0).inverse() * walk(i) * Pose::exp(twist);
}

TEST_F(MapLocalizerTest, DriftIsBoundedWhereTheMapIsKnown) {
  for (const bool enabled : {true, false}) {
    LocalizerOptions options = often();
    options.enabled = enabled;
    MapLocalizer localizer(options);
    place(localizer, walk(0));
    for (int i = 0; i < kFramesOfWalk; ++i) localizer.track(onWalk(i).pyramid, drifted(i), true);
    const double error = error_m(localizer, walk(kFramesOfWalk - 1));
    if (enabled) {
      EXPECT_LT(error, 0.02);
      EXPECT_GE(localizer.statistics().registered, 4u);
      EXPECT_EQ(localizer.live().state, MapState::kPlaced);
    } else {
      EXPECT_GT(error, 0.04) << "the drift itself";
      EXPECT_EQ(localizer.statistics().attempts, 0u);
    }
  }
}

TEST_F(MapLocalizerTest, WhatConsumersSeeDoesNotJump) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  Pose T_before;
  for (int i = 0; i < kFramesOfWalk; ++i) {
    localizer.track(onWalk(i).pyramid, drifted(2 * i), true);
    const Pose T_odom = drifted(2 * i);
    const Pose T_map_odom = localizer.live().T_map_cam * T_odom.inverse();
    if (i > 0) {
      EXPECT_LT((T_before.inverse() * T_map_odom).translation().norm(), 0.02) << i;
    }
    T_before = T_map_odom;
    if (i == kFramesOfWalk / 2) localizer.correct({"r", 1, "m", walk(0) * standing(0.05, 0, 0.01), 2}, 0);
  }
}

TEST_F(MapLocalizerTest, ACarriedOffRobotFindsItselfWhereOnlyOthersHaveBeen) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  for (int i = 0; i < 4; ++i) localizer.track(onWalk(i).pyramid, walk(0).inverse() * walk(i), true);
  ASSERT_EQ(localizer.live().state, MapState::kPlaced);
  // A new chain begins in the other half of the room; the odometry goes on from where it was.
  const Pose T_odom_away = walk(0).inverse() * walk(3);
  localizer.track(onOtherWalk(2).pyramid, T_odom_away, false);
  localizer.keyframeMade(3, "r-1-3");
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  localizer.correct({"r", 1, "r-1-3", T_odom_away.inverse(), 2}, 4);
  EXPECT_EQ(localizer.live().map, "r-1-3") << "all that is known";
  EXPECT_FALSE(localizer.tiles().tiles().empty()) << "yet the map is kept";
  int found = -1;
  for (int i = 2; i < kFramesOfWalk && found < 0; ++i) {
    const Seen& seen = onOtherWalk(i);
    const Pose T_odom_cam = T_odom_away * otherWalk(2).inverse() * otherWalk(i);
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
  const Pose T_map_odom = otherWalk(2) * T_odom_away.inverse();
  localizer.correct({"r", 1, "m", T_map_odom, 4}, 5);
  EXPECT_EQ(localizer.live().state, MapState::kPlaced);
  EXPECT_LT(error_m(localizer, otherWalk(found)), 0.02);
  EXPECT_FALSE(localizer.believed());
  EXPECT_FALSE(localizer.interestAt());
}

TEST_F(MapLocalizerTest, APlaceOfItsOwnMemoryIsAHypothesisUntilTheCoreHasJoinedTheChains) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  for (int i = 0; i < 4; ++i) localizer.track(onWalk(i).pyramid, walk(0).inverse() * walk(i), true);
  const Pose T_odom_cam = walk(0).inverse() * walk(1);
  localizer.recognise(0, T_odom_cam);
  localizer.track(onWalk(1).pyramid, T_odom_cam, false);
  localizer.keyframeMade(3, "r-1-3");
  EXPECT_EQ(localizer.live().state, MapState::kRecognised);
  ASSERT_TRUE(localizer.believed());
  EXPECT_EQ(localizer.believed()->map, "m");
  EXPECT_LT(error_m(localizer, walk(1)), 0.01);
  localizer.correct({"r", 1, "m", walk(0), 2}, 4);
  EXPECT_EQ(localizer.live().state, MapState::kPlaced);
  // The next chain begins where it knows nothing; places of the chains before are in frames of their own.
  localizer.track(onWalk(1).pyramid, T_odom_cam, false);
  localizer.keyframeMade(6, "r-1-6");
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  localizer.recognise(0, T_odom_cam);
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  localizer.correct({"r", 1, "m", otherWalk(0), 3}, 7);
  ASSERT_EQ(localizer.live().state, MapState::kPlaced);
  localizer.recognise(5, T_odom_cam);
  EXPECT_EQ(localizer.live().state, MapState::kPlaced) << "keyframe 5 was of a chain that stands otherwise";
  localizer.recognise(6, T_odom_cam);
  EXPECT_EQ(localizer.live().state, MapState::kRecognised);
}

TEST_F(MapLocalizerTest, ARoomThatOnlyLooksSimilarIsNotBelieved) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  localizer.track(onWalk(0).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  for (int i = 0; i < 8; ++i) {
    const Seen& seen = see(kOtherRoom, true, i);
    EXPECT_FALSE(localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i)));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  EXPECT_GE(localizer.statistics().searched, 8u);
}

TEST_F(MapLocalizerTest, TwoPlacesThatBothFitAreBothRefused) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  // The same room once more, 20 m further on.
  for (Tile tile : tiles()) {
    tile.key.x += 40;
    for (TilePlace& at : tile.places)
      at.T_map_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(20, 0, 0)) * at.T_map_cam;
    ASSERT_TRUE(localizer.put(std::move(tile)));
  }
  localizer.track(onWalk(0).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  for (int i = 0; i < 6; ++i) {
    const Seen& seen = onOtherWalk(i);
    EXPECT_FALSE(localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i)));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
}

TEST_F(MapLocalizerTest, ARecognisedPlaceThatTurnsOutToBeAnotherIsTakenBack) {
  MapLocalizer localizer(often());
  place(localizer, walk(0));
  localizer.track(onWalk(0).pyramid, Pose(), true);
  localizer.keyframeMade(1, "r-1-1");
  int i = 0;
  for (; i < 8 && localizer.live().state == MapState::kAstray; ++i) {
    const Seen& seen = onOtherWalk(i);
    (void)localizer.search(seen.pyramid, seen.code, otherWalk(0).inverse() * otherWalk(i));
    localizer.track(seen.pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  }
  ASSERT_EQ(localizer.live().state, MapState::kRecognised);
  for (const int end = i + 8; i < end; ++i)
    localizer.track(see(kOtherRoom, true, i).pyramid, otherWalk(0).inverse() * otherWalk(i), true);
  EXPECT_EQ(localizer.live().state, MapState::kAstray);
  EXPECT_EQ(localizer.statistics().taken_back, 1u) << reasons(localizer);
}

TEST_F(MapLocalizerTest, AfterLongEnoughOnANewChainTheOldMapIsGivenUp) {
  LocalizerOptions options = often();
  options.astray_keyframes = 5;
  MapLocalizer localizer(options);
  place(localizer, walk(0));
  localizer.track(onWalk(0).pyramid, Pose(), true);
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
