// The agent against a core that the test plays by hand: the map that comes back, and finding itself in it.
#include "tests/edge_agent/agent/agent_fixture.h"
#include "tests/scenes/scene_tiles.h"

namespace comap {
namespace {

using std::chrono::milliseconds;

using AgentMapTest = AgentTest;

TEST_F(AgentMapTest, CorrectionsAndTilesOfItsMapAreKept) {
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  const auto correct = [&](const MapId& map, uint64_t revision) {
    ASSERT_TRUE(core_->publish(Topic::kCorrection, "r", *encodeCorrection({"r", kSession, map, Pose(), revision})));
  };
  const auto give = [&](const MapId& map, uint64_t revision) {
    Tile tile;
    tile.key = {map, 1, 2, 3};
    tile.revision = revision;
    tile.surfels.resize(5);
    ASSERT_TRUE(core_->publish(Topic::kTile, "r", *encodeTile(tile)));
  };
  correct("m", 2);
  give("m", 1);
  give("other", 1);
  correct("old", 1);  // overtaken on the way
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  ASSERT_TRUE(agent.correction());
  EXPECT_EQ(agent.correction()->map, "m");
  EXPECT_EQ(agent.tiles().tiles().size(), 1u);
  EXPECT_EQ(agent.statistics().tiles_received, 1u);
  correct("joint", 3);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  EXPECT_TRUE(agent.tiles().tiles().empty());
}

// The core may fall silent, or the camera be covered, before the next interest is due.
TEST_F(AgentMapTest, AsksForTheTilesOfAnotherMapAtOnce) {
  config_.interest_every_frames = 1000;
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  acknowledge(0);
  ASSERT_TRUE(agent.takeFrame());
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  EXPECT_EQ(interests(), 0);
  const auto correct = [&](const MapId& map, uint64_t revision) {
    ASSERT_TRUE(core_->publish(Topic::kCorrection, "r", *encodeCorrection({"r", kSession, map, Pose(), revision})));
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
  };
  correct("m", 1);
  EXPECT_EQ(interests(), 1);
  correct("m", 2);
  EXPECT_EQ(interests(), 0) << "of this one it has asked";
  correct("joint", 3);
  EXPECT_EQ(interests(), 1);
}

TEST_F(AgentMapTest, AsksForTilesWhileLost) {
  config_.interest_every_frames = 2;
  WalkSource source(40, 4, 40, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  acknowledge(0);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(agent.takeFrame());
  ASSERT_EQ(agent.tracking(), TrackingState::kLost);
  (void)interests();
  for (int i = 30; i < 40; ++i) ASSERT_TRUE(agent.takeFrame());
  EXPECT_EQ(interests(), 5);
}

// Others go on mapping where it stands.
TEST_F(AgentMapTest, AsksForTilesWhileItsCameraGivesNothing) {
  config_.interest_every_frames = 1000;
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  acknowledge(0);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  ASSERT_TRUE(agent.takeFrame());
  (void)interests();
  int asked = 0;
  for (int i = 0; i < 400 && asked < 2; ++i) {
    ASSERT_TRUE(agent.exchange(milliseconds(50)));
    asked += interests();
  }
  EXPECT_EQ(asked, 2);
}

TEST_F(AgentMapTest, CarriedOffToAPlaceOfItsOwnItIsPlacedOnceTheCoreSaysSo) {
  WalkSource source(70, 30, 45, -1);
  source.carried_off = true;
  Agent agent = makeAgent(source);
  std::vector<Keyframe> keyframes;
  ASSERT_TRUE(agent.hello());
  serve(keyframes);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  const auto correct = [&](const MapId& map, uint64_t revision) {
    ASSERT_TRUE(core_->publish(Topic::kCorrection, "r", *encodeCorrection({"r", kSession, map, Pose(), revision})));
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
  };
  std::optional<MapId> chain;
  for (int i = 0; i < 70; ++i) {
    ASSERT_TRUE(agent.takeFrame());
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
    serve(keyframes);
    if (i == 0) correct("m", 1);
    if (agent.statistics().chains < 2) continue;
    const LivePose live = agent.livePose();
    EXPECT_EQ(live.state, MapState::kRecognised) << i;
    ASSERT_TRUE(live.hypothesis) << i;
    EXPECT_EQ(live.hypothesis->map, "m");
    EXPECT_NEAR(live.hypothesis->T_map_cam.translation().x(), 0.02 * (i - 45), 0.01) << i;
  }
  ASSERT_TRUE(agent.closeKeyframe());
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  serve(keyframes);
  for (const Keyframe& keyframe : keyframes)
    if (!keyframe.linked && keyframe.id.sequence > 0) chain = mapIdOf(keyframe.id);
  ASSERT_TRUE(chain);
  EXPECT_TRUE(keyframes.back().believed);
  serve(keyframes);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  correct("m", 2);
  EXPECT_EQ(agent.livePose().state, MapState::kPlaced);
}

TEST_F(AgentMapTest, CarriedOffToWhereOnlyOthersHaveBeenItFindsItselfInTheMapAndSaysSo) {
  WalkSource source(70, 12, 32, -1);
  source.turned_away = true;
  Agent agent = makeAgent(source);
  std::vector<Keyframe> keyframes;
  ASSERT_TRUE(agent.hello());
  serve(keyframes);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  ASSERT_TRUE(agent.takeFrame());
  // The core has the robot in a map of which others have seen both parts.
  const Correction correction{"r", kSession, "m", Pose(), 1};
  ASSERT_TRUE(core_->publish(Topic::kCorrection, "r", *encodeCorrection(correction)));
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  std::vector<Pose> views;
  for (int i = 0; i < 40; i += 8) views.insert(views.end(), {WalkSource::ahead(i), WalkSource::away(i)});
  for (const Tile& tile : sceneTiles(Scene::room(), views, "m"))
    ASSERT_TRUE(core_->publish(Topic::kTile, "r", *encodeTile(tile)));
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  ASSERT_FALSE(agent.tiles().tiles().empty());

  std::optional<int> found;
  for (int i = 1; i < 70; ++i) {
    ASSERT_TRUE(agent.takeFrame());
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
    serve(keyframes);
    const LivePose live = agent.livePose();
    if (i < 12) {
      EXPECT_EQ(live.state, MapState::kPlaced);
    }
    if (i < 32 || live.state != MapState::kRecognised) continue;
    if (!found) found = i - 32;
    const Pose error = WalkSource::away(i - 32).inverse() * live.hypothesis->T_map_cam;
    EXPECT_LT(error.translation().norm(), 0.03) << i;
    EXPECT_LT(error.angle(), 0.02) << i;
  }
  ASSERT_TRUE(found);
  EXPECT_LT(*found, 30) << "a second";
  EXPECT_EQ(agent.localizer().statistics().recognised, 1u);
  ASSERT_TRUE(agent.closeKeyframe());
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  serve(keyframes);
  size_t believed = 0;
  for (const Keyframe& keyframe : keyframes) believed += keyframe.believed && keyframe.believed->map == "m";
  EXPECT_GE(believed, 1u);
  EXPECT_FALSE(keyframes.front().believed) << "the core knew that one";
}

}  // namespace
}  // namespace comap
