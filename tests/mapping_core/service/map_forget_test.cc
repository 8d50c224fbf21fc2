// One robot of three is taken out: what is left is what the others' keyframes, loops and matches make by themselves.
#include <algorithm>

#include "mapping_core/service/map_finish.h"
#include "mapping_core/service/mapping_service.h"
#include "mapping_core/tiles/tile_builder.h"
#include "protocol/link/loopback_link.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapForget : public StoreTest {
 protected:
  // What `fleet forget` does with a store from which a robot has been removed.
  static MapHashes judgeAnew(gpu::Device& device, MapStore& store) {
    MapBuilder builder(device, store, roomOptions());
    EXPECT_TRUE(builder.restore());
    EXPECT_TRUE(builder.recast());
    return finish(builder);
  }
  // What `fleet finish` makes of it, and what a core that starts on it and ends without a new keyframe does.
  static std::vector<Tile> finished(gpu::Device& device, MapStore& store, bool recast) {
    MapBuilder builder(device, store, roomOptions());
    EXPECT_TRUE(builder.restore());
    EXPECT_EQ(builder.recastDue(), recast);
    EXPECT_TRUE(!recast || builder.recast());
    return *finishMaps(builder, store, roomOptions().fusion.stable_confidence, {});
  }
  static std::vector<std::string> coreEnds(gpu::Device& device, MapStore& store) {
    ServiceOptions options;
    options.mapping = roomOptions();
    LoopbackHub hub;
    const auto link = hub.connect(LinkRole::kCore);
    std::vector<std::string> log;
    MappingService service(options, *link, store, device,
                           [&](LogLevel, const std::string& line) { log.push_back(line); });
    EXPECT_TRUE(service.resume());
    const auto ended = service.finish({});
    EXPECT_TRUE(ended) << ended.error().text;
    EXPECT_EQ(service.statistics().merges, 1u);
    return log;
  }
};

TEST_F(MapForget, TheOthersAreWhatTheyWouldBeHadTheRobotNeverBeen) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  size_t robots = 0;
  {
    MapBuilder builder(device, *store, roomOptions());
    for (const MergeRecord& merge : mapTurns(builder, *store, "abc", 0, 5)) robots = merge.robots.size();
    ASSERT_EQ(robots, 3u) << "all are one map";
  }
  ASSERT_EQ(*store->removeRobot("b"), 5u);
  const std::vector<Edge> edges = *store->edges();
  const std::vector<MatchVerdict> verdicts = *store->verdicts({true, "", ""});
  const MapHashes left = judgeAnew(device, *store);
  ASSERT_EQ(left.size(), 1u) << "the closures between the others join them";

  // A store that has never heard of b, with the same loops of each of the others and the same matches between them.
  auto never = MapStore::open(folder_ / "never.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(never);
  {
    MapBuilderOptions blind = roomOptions();
    blind.search.max_dissimilarity = -1;
    MapBuilder builder(device, *never, blind);
    mapTurns(builder, *never, "ac", 0, 5);
  }
  size_t between = 0;
  for (const Edge& edge : edges) {
    if (edge.kind == EdgeKind::kOdometry || edge.from.robot != edge.to.robot) continue;
    ASSERT_TRUE(never->addEdge(edge));
  }
  for (const MatchVerdict& verdict : verdicts) {
    EXPECT_NE(verdict.query.robot, "b");
    EXPECT_NE(verdict.candidate.robot, "b");
    between += verdict.query.robot != verdict.candidate.robot;
    ASSERT_TRUE(never->addVerdict(verdict));
  }
  EXPECT_GE(between, 2u);
  EXPECT_EQ(judgeAnew(device, *never), left);

  // And what the store holds for ever after is that.
  MapBuilder builder(device, *store, roomOptions());
  ASSERT_TRUE(builder.restore());
  EXPECT_EQ(finish(builder), left);
}

TEST_F(MapForget, ACoreToWhichNothingComesJudgesAnewBeforeItEnds) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto copy = folder_ / "copy.comap";
  {
    auto store = create();
    ASSERT_TRUE(store);
    MapBuilder builder(device, *store, roomOptions());
    mapTurns(builder, *store, "abc", 0, 5);
    ASSERT_EQ(*store->removeRobot("b"), 5u);
  }
  std::filesystem::copy_file(path_, copy);
  auto by_core = create(), by_hand = MapStore::open(copy, MapStore::Mode::kOpen);
  ASSERT_TRUE(by_core);
  ASSERT_TRUE(by_hand);
  ASSERT_TRUE(*by_core->votesWait());
  const std::vector<std::string> log = coreEnds(device, *by_core);
  EXPECT_EQ(std::count_if(log.begin(), log.end(), [](const auto& line) { return line.find(" are one") != line.npos; }),
            1);
  EXPECT_FALSE(*by_core->votesWait()) << "nothing is left to be done";
  EXPECT_EQ(*by_core->meta("complete"), "yes");
  EXPECT_EQ(by_core->merges()->size(), 1u);
  const std::vector<Tile> tiles = finished(device, *by_hand, true);
  EXPECT_EQ(hashTiles(*by_core->tiles("")), hashTiles(tiles));
  EXPECT_EQ(hashTiles(finished(device, *by_core, false)), hashTiles(tiles)) << "and stays so";
}

}  // namespace
}  // namespace comap
