// A builder filled from its store is the one that filled it.
#include "mapping_core/ferns/fern_encoder.h"
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

// Their outbox kept them while the core refused their robot; once its book is set right they come. And a core may be
// started with another book than its store was made with.
TEST_F(MapRestore, KeyframesWithCodesOfAnotherFernBookTakePartLikeAllOthers) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  const FernBook other = FernBook::standard(99);
  {
    MapBuilder builder(device, *store, roomOptions());
    for (uint32_t i = 0; i < 5; ++i)
      for (const char robot : {'a', 'b'}) {
        Keyframe keyframe = roomKeyframe(robot, i);
        if (robot == 'b') keyframe.fern_code = encodeFerns(other, keyframe.colour, keyframe.depth);
        keep(*store, keyframe);
        const auto change = builder.addKeyframe(keyframe, robot == 'a' ? 0 : 1);
        ASSERT_TRUE(change) << change.error().text;
      }
    EXPECT_EQ(builder.components().anchors().size(), 1u) << "they were found by their codes";
  }
  for (const uint32_t seed : {FernBook::kStandardSeed, 99u, 7u}) {
    MapBuilderOptions options = roomOptions();
    options.fern_seed = seed;
    MapBuilder builder(device, *store, options);
    const auto restored = builder.restore();
    ASSERT_TRUE(restored) << seed << ": " << restored.error().text;
    EXPECT_EQ(builder.poses().size(), 10u);
    const FernCode code = builder.placesOf(builder.components().anchors().front()).front().code;
    EXPECT_EQ(code.book_hash, FernBook::standard(seed).hash());
  }
}

}  // namespace
}  // namespace comap
