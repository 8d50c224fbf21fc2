// Taking merges back and giving them again, in a builder that lives.
#include <algorithm>

#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapUndo : public StoreTest {
 protected:
  static size_t between(const std::vector<Edge>& edges, const std::string& a, const std::string& b) {
    return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [&](const Edge& edge) {
      return (edge.from.robot == a && edge.to.robot == b) || (edge.from.robot == b && edge.to.robot == a);
    }));
  }
};

TEST_F(MapUndo, PartsAreWhatTheyWouldBeWithoutTheMergeAndRejoinedTheyAreWhatTheyWere) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilder builder(device, *store, roomOptions());
  const auto merges = mapTurns(builder, *store, "ab", 0, 8);
  ASSERT_EQ(merges.size(), 1u);
  const MapHashes joint = finish(builder);
  ASSERT_EQ(joint.size(), 1u);
  const std::vector<Edge> edges = *store->edges();
  ASSERT_GT(between(edges, "a", "b"), 2u) << "loops of the joint map, besides the closures";

  const auto parted = builder.split(1, "a test");
  ASSERT_TRUE(parted) << parted.error().text;
  ASSERT_EQ(parted->undone.size(), 1u);
  EXPECT_EQ(parted->undone[0].undone, "a test");
  EXPECT_FALSE(builder.caughtUp());
  const MapHashes two = finish(builder);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(between(*store->edges(), "a", "b"), 0u);
  EXPECT_EQ(store->withdrawnEdges()->size(), between(edges, "a", "b"));
  const std::vector<StoredKeyframe> keyframes = *store->keyframes();
  for (const StoredKeyframe& keyframe : keyframes) EXPECT_EQ(keyframe.map, keyframe.id.robot + "-1-0");

  // A store in which nobody ever saw the other, with the same loops.
  const auto apart_path = folder_ / "apart.comap";
  auto apart_store = MapStore::open(apart_path, MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(apart_store);
  MapBuilderOptions blind = roomOptions();
  blind.search.max_dissimilarity = -1;
  MapBuilder apart(device, *apart_store, blind);
  mapTurns(apart, *apart_store, "ab", 0, 8);
  size_t loops = 0;
  for (const Edge& edge : edges) {
    if (edge.kind == EdgeKind::kOdometry || edge.from.robot != edge.to.robot) continue;
    ASSERT_TRUE(apart_store->addEdge(edge));
    ++loops;
  }
  EXPECT_GT(loops, 0u);
  EXPECT_EQ(finish(apart), two);

  const auto again = builder.rejoin(1);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(again->merges.size(), 1u);
  EXPECT_EQ(finish(builder), joint);
  EXPECT_EQ(store->edges()->size(), edges.size());
  EXPECT_TRUE(store->withdrawnEdges()->empty());
  EXPECT_TRUE(store->merges()->front().undone.empty());
}

TEST_F(MapUndo, MappingGoesOnInBothPartsAndNewClosuresMayJoinThemAnew) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilder builder(device, *store, roomOptions());
  ASSERT_EQ(mapTurns(builder, *store, "ab", 0, 6).size(), 1u);
  ASSERT_TRUE(builder.split(1, "a test"));
  const auto merges = mapTurns(builder, *store, "ab", 6, 9);
  ASSERT_EQ(merges.size(), 1u) << "two closures of new keyframes";
  EXPECT_EQ(merges[0].number, 2u);
  EXPECT_TRUE(builder.caughtUp());
  EXPECT_EQ(finish(builder).size(), 1u);
  const std::vector<Edge> edges = *store->edges();
  for (const Edge& edge : edges) EXPECT_NE(edge.merge, 1u) << "what was withdrawn stays so";

  const auto refused = builder.rejoin(1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(refused.error().text.find("joined by another merge"), std::string::npos) << refused.error().text;
  EXPECT_FALSE(store->withdrawnEdges()->empty()) << "a refusal changes nothing";
  ASSERT_TRUE(builder.split(2, "another"));
  ASSERT_TRUE(builder.rejoin(1));
  EXPECT_EQ(finish(builder).size(), 1u);
}

TEST_F(MapUndo, RefusesWhatMakesNoSenseAndChangesNothing) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilder builder(device, *store, roomOptions());
  ASSERT_EQ(mapTurns(builder, *store, "ab", 0, 5).size(), 1u);
  const auto texts = [](const Result<MapChange>& result) { return result ? std::string() : result.error().text; };
  EXPECT_EQ(texts(builder.split(7, "x")), "merge 7 is not in the store, which holds 1 merge");
  EXPECT_EQ(texts(builder.split(1, "")), "merge 1 cannot be undone without a reason");
  EXPECT_EQ(texts(builder.rejoin(1)), "merge 1 is not undone");
  EXPECT_EQ(builder.components().anchors().size(), 1u);
  ASSERT_TRUE(builder.split(1, "x"));
  EXPECT_EQ(texts(builder.split(1, "y")), "merge 1 is undone already: x");
  EXPECT_EQ(store->merges()->front().undone, "x");
}

}  // namespace
}  // namespace comap
