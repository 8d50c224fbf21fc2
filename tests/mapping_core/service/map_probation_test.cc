// Merges that were wrong come apart by themselves, those that were right stay.
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

MapBuilderOptions blindOptions() {
  MapBuilderOptions options = roomOptions();
  options.search.max_dissimilarity = -1;
  return options;
}

// The checks that a merge must pass when it is made are switched off.
MapBuilderOptions credulous(MapBuilderOptions options) {
  options.merge_check.contradicted = 1;
  return options;
}

class MapProbation : public StoreTest {};

TEST_F(MapProbation, AForcedMergeOfTwoRoomsComesApartAndLeavesNoTrace) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  {
    MapBuilder builder(device, *store, blindOptions());
    ASSERT_TRUE(mapTurns(builder, *store, "ax", 0, 3).empty());
  }
  forgeMatch(*store, 'a', 'x', 0);
  forgeMatch(*store, 'a', 'x', 2);
  MapBuilder builder(device, *store, credulous(blindOptions()));
  ASSERT_TRUE(builder.restore());
  const auto forced = builder.recast();
  ASSERT_TRUE(forced);
  ASSERT_EQ(forced->merges.size(), 1u);
  ASSERT_EQ(builder.components().anchors().size(), 1u);

  const MapChange change = mapAll(builder, *store, "ax", 3, 6);
  ASSERT_EQ(change.undone.size(), 1u);
  EXPECT_EQ(change.undone[0].number, 1u);
  EXPECT_NE(change.undone[0].undone.find("contradicts it"), std::string::npos) << change.undone[0].undone;
  EXPECT_EQ(store->merges()->front().undone, change.undone[0].undone) << "the event is stored with its reason";
  EXPECT_TRUE(change.merges.empty()) << "the same evidence joins nothing again";
  EXPECT_TRUE(change.confirmed.empty());
  EXPECT_EQ(builder.components().anchors().size(), 2u);
  EXPECT_EQ(*store->votesWait(), builder.recastDue()) << "a core that starts on the store knows it too";

  auto apart_store = MapStore::open(folder_ / "apart.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(apart_store);
  MapBuilder apart(device, *apart_store, blindOptions());
  mapTurns(apart, *apart_store, "ax", 0, 6);
  EXPECT_EQ(finish(builder), finish(apart));

  // New closures that say the same are weighed against what parted the maps.
  forgeMatch(*store, 'a', 'x', 4);
  forgeMatch(*store, 'a', 'x', 5);
  MapBuilder again(device, *store, credulous(blindOptions()));
  ASSERT_TRUE(again.restore());
  const auto refused = again.recast();
  ASSERT_TRUE(refused);
  EXPECT_TRUE(refused->merges.empty());
  EXPECT_EQ(store->verdicts({false, "contradiction", ""})->size(), 2u) << "of both voters";
}

// Two robots in one room, whose maps were joined in the wrong place.
class MapInTheWrongPlace : public MapProbation {
 protected:
  // `reason`: what parts them. Closures then join them where they belong.
  void run(gpu::Device& device, size_t witnesses, uint32_t last, const std::string& reason) {
    auto store = create();
    ASSERT_TRUE(store);
    {
      MapBuilder builder(device, *store, blindOptions());
      ASSERT_TRUE(mapTurns(builder, *store, "ab", 0, 4).empty());
    }
    const Pose wrong(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), {0.8, 0, 0.5});
    forgeMatch(*store, 'a', 'b', 0, wrong);
    forgeMatch(*store, 'a', 'b', 3, wrong);
    MapBuilderOptions options = credulous(roomOptions());
    options.probation.contradicted = options.probation.witness_contradicted = 1;  // only closures tell
    options.probation.witnesses = witnesses;
    MapBuilder builder(device, *store, options);
    ASSERT_TRUE(builder.restore());
    const auto forced = builder.recast();
    ASSERT_TRUE(forced);
    ASSERT_EQ(forced->merges.size(), 1u);

    const MapChange change = mapAll(builder, *store, "ab", 4, last);
    ASSERT_EQ(change.undone.size(), 1u);
    EXPECT_EQ(change.undone[0].undone, reason);
    ASSERT_EQ(change.merges.size(), 1u);
    EXPECT_EQ(change.merges[0].number, 2u);
    EXPECT_EQ(builder.components().anchors().size(), 1u);
    const Pose T_a_b = builder.poses().at({"a", 1, 5}).inverse() * builder.poses().at({"b", 1, 5});
    const Pose error = (roomPose('a', 5).inverse() * roomPose('b', 5)).inverse() * T_a_b;
    EXPECT_LT(error.translation().norm(), 0.02);
  }
};

TEST_F(MapInTheWrongPlace, ClosuresThatAgreeWithEachOtherPartThemAndJoinThemAnew) {
  COMAP_DEVICE_OR_SKIP(device);
  run(device, 10, 9, "2 closures that agree with each other contradict it, 2 support it");
}

TEST_F(MapInTheWrongPlace, AMergeBeyondDoubtThatTheGraphRejectsComesApartAtOnce) {
  COMAP_DEVICE_OR_SKIP(device);
  run(device, 0, 14, "the graph rejects all closures that made it");
}

TEST_F(MapProbation, ARightMergeIsConfirmedByLaterKeyframes) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilderOptions options = roomOptions();
  options.probation.witnesses = 6;
  {
    MapBuilder builder(device, *store, options);
    const MapChange change = mapAll(builder, *store, "ab", 0, 4);
    ASSERT_EQ(change.merges.size(), 1u);
    EXPECT_TRUE(change.confirmed.empty());
  }
  // A core that was restarted has heard nothing yet, but knows what there is to hear.
  MapBuilder builder(device, *store, options);
  ASSERT_TRUE(builder.restore());
  const MapChange change = mapAll(builder, *store, "ab", 4, 7);
  EXPECT_TRUE(change.undone.empty());
  ASSERT_EQ(change.confirmed.size(), 1u);
  EXPECT_EQ(change.confirmed[0].merge, 1u);
  EXPECT_GE(change.confirmed[0].witnesses, 6u);
  EXPECT_GE(change.confirmed[0].supporters, 2u);
  EXPECT_LT(change.confirmed[0].contradicted, 0.0025);
}

}  // namespace
}  // namespace comap
