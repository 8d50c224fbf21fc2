// A builder filled from its store is the one that filled it.
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapRestore : public StoreTest {};

TEST_F(MapRestore, GivesTheMapsOfTheCoreThatHadFinishedAndMapsOn) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapHashes expected;
  {
    MapBuilder builder(device, *store, roomOptions());
    EXPECT_EQ(mapTurns(builder, *store, "ab", 0, 5).size(), 1u);
    mapTurns(builder, *store, "c", 20, 22);  // looks elsewhere: a map of its own
    expected = finish(builder);
    ASSERT_EQ(expected.size(), 2u);
  }
  MapBuilder builder(device, *store, roomOptions());
  const auto restored = builder.restore();
  ASSERT_TRUE(restored) << restored.error().text;
  EXPECT_EQ(builder.components().anchors().size(), 2u);
  EXPECT_EQ(builder.poses().size(), 12u);
  const auto one = builder.catchUp(1);
  ASSERT_TRUE(one);
  EXPECT_FALSE(*one);
  ASSERT_TRUE(*builder.catchUp(100));
  EXPECT_EQ(hashesOf(builder), expected);
  EXPECT_EQ(finish(builder), expected);

  const size_t edges = store->edges()->size();
  EXPECT_TRUE(mapTurns(builder, *store, "ab", 5, 6).empty()) << "they are one map already";
  EXPECT_GT(store->edges()->size(), edges + 2) << "odometry, and loops to keyframes of before";
  EXPECT_EQ(finish(builder).size(), 2u);
  ASSERT_TRUE(builder.split(1, "a test")) << "the merge of before can be taken back";
  EXPECT_EQ(finish(builder).size(), 3u);
}

TEST_F(MapRestore, VotesThatWaitedStillCount) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilderOptions options = roomOptions();
  options.search.candidates = 1;
  uint32_t next = 0;
  const auto accepted = [&] { return store->verdicts({true, "", ""})->size(); };
  {
    MapBuilder builder(device, *store, options);
    mapTurns(builder, *store, "a", 0, 4);
    const size_t before = accepted();
    for (; accepted() == before && next < 4; ++next)
      ASSERT_TRUE(mapTurns(builder, *store, "b", next, next + 1).empty());
    ASSERT_EQ(accepted(), before + 1) << "a vote waits";
  }
  std::vector<MergeRecord> merges;
  MapBuilder builder(device, *store, options);
  ASSERT_TRUE(builder.restore());
  const size_t before = accepted();
  for (; accepted() == before && next < 6; ++next) merges = mapTurns(builder, *store, "b", next, next + 1);
  ASSERT_EQ(merges.size(), 1u) << "the first new closure agrees with it";
  EXPECT_EQ(merges[0].voters.size(), 2u);
}

TEST_F(MapRestore, WhatAFailedMappingLeftIsNotThere) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  {
    MapBuilder builder(device, *store, roomOptions());
    mapTurns(builder, *store, "a", 0, 2);
    const Keyframe unknown = roomKeyframe('a', 2);  // not kept: its pose cannot be stored, the last thing that is
    ASSERT_FALSE(builder.addKeyframe(unknown, 0));
  }
  EXPECT_EQ(store->edges()->size(), 1u);
  MapBuilder builder(device, *store, roomOptions());
  ASSERT_TRUE(builder.restore());
  EXPECT_EQ(builder.poses().size(), 2u);
  mapTurns(builder, *store, "a", 2, 3);
  EXPECT_EQ(store->keyframes()->size(), 3u);
  EXPECT_EQ(builder.components().members({"a", 1, 0}).size(), 3u);
}

TEST_F(MapRestore, AStoreOfAnotherFernBookIsRefused) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  for (uint32_t i = 0; i < 2; ++i) {
    Keyframe keyframe = roomKeyframe('a', i);
    keyframe.fern_code.book_hash += i;
    keep(*store, keyframe);
    ASSERT_TRUE(store->setPoses("a-1-0", {{keyframe.id, Pose()}}));
  }
  MapBuilder builder(device, *store, roomOptions());
  const auto restored = builder.restore();
  ASSERT_FALSE(restored);
  EXPECT_EQ(restored.error().code, ErrorCode::kBadData);
  EXPECT_NE(restored.error().text.find("a/1/1"), std::string::npos) << restored.error().text;
}

}  // namespace
}  // namespace comap
