// A map that two others fit equally well, which cannot both be right, is joined with neither until views decide.
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

// Robot a has walked through one room, x through another; of b's room little is known yet.
class MapRivals : public StoreTest {
 protected:
  // Nothing is matched but what is forged; from the few views of b nothing is concluded, from those of a and x it is.
  static MapBuilderOptions options() {
    MapBuilderOptions options = roomOptions();
    options.search.max_dissimilarity = -1;
    options.probation.fewest_views = 30;
    options.merge_check.view_overlap = 0.15;
    return options;
  }

  void mapRooms(gpu::Device& device, MapStore& store) {
    MapBuilder builder(device, store, options());
    ASSERT_TRUE(mapTurns(builder, store, "ax", 0, 6).empty());
    ASSERT_TRUE(mapTurns(builder, store, "b", 0, 2).empty());
  }

  // Casts what was forged, as a core that starts does.
  static MapChange recast(gpu::Device& device, MapStore& store) {
    MapBuilder builder(device, store, options());
    EXPECT_TRUE(builder.restore());
    const auto change = builder.recast();
    EXPECT_TRUE(change);
    return *change;
  }
};

TEST_F(MapRivals, NeitherIsJoinedWhileBothFitAndOneMustBeWrong) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  mapRooms(device, *store);
  forgeMatch(*store, 'b', 'x', 1);
  forgeMatch(*store, 'a', 'b', 0);
  forgeMatch(*store, 'a', 'b', 1);
  const MapChange waiting = recast(device, *store);
  EXPECT_TRUE(waiting.merges.empty());
  ASSERT_EQ(waiting.verdicts.size(), 1u);
  EXPECT_EQ(waiting.verdicts[0].reason, "rival");
  EXPECT_EQ(store->verdicts({false, "rival", ""})->size(), 1u) << "the refusal is stored with its reason";

  // Its votes have waited over a restart. More of b's views now refute that it is x's room.
  {
    MapBuilder builder(device, *store, options());
    ASSERT_TRUE(builder.restore());
    ASSERT_TRUE(mapTurns(builder, *store, "b", 2, 6).empty());
  }
  const MapChange decided = recast(device, *store);
  ASSERT_EQ(decided.merges.size(), 1u);
  EXPECT_EQ(decided.merges[0].robots, (std::vector<std::string>{"a", "b"}));
}

TEST_F(MapRivals, AThirdMapThatMayBeTheSamePlaceIsNone) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  {
    MapBuilder builder(device, *store, options());
    ASSERT_TRUE(mapTurns(builder, *store, "ac", 0, 6).empty());
    ASSERT_TRUE(mapTurns(builder, *store, "b", 0, 2).empty());
  }
  forgeMatch(*store, 'b', 'c', 1);
  forgeMatch(*store, 'a', 'b', 0);
  forgeMatch(*store, 'a', 'b', 1);
  const MapChange change = recast(device, *store);
  ASSERT_EQ(change.merges.size(), 1u);
  EXPECT_EQ(store->verdicts({false, "rival", ""})->size(), 0u);
}

}  // namespace
}  // namespace comap
