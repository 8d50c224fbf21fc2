// What is told of a store without reading its pictures.
#include "mapping_core/store/store_glance.h"

#include <gmock/gmock.h>

#include "mapping_core/store/keyframe_places.h"
#include "mapping_core/store/keyframe_runs.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr uint32_t kKeyframes = 30;

class StoreGlanceTest : public StoreTest {
 protected:
  static std::vector<uint8_t> messageOf(uint32_t sequence) {
    Keyframe keyframe;
    keyframe.id = idOf(sequence);
    keyframe.camera = {60, 60, 32, 24, 64, 48};
    keyframe.colour = ColourImage(64, 48, Rgb{uint8_t(sequence), 2, 3});
    keyframe.depth = DepthImage(64, 48, 2000);
    const auto encoded = encodeKeyframe(keyframe);
    EXPECT_TRUE(encoded);
    return encoded ? *encoded : std::vector<uint8_t>();
  }
  void fill() {
    auto store = create();
    ASSERT_TRUE(store);
    std::vector<Tile> tiles;
    for (uint32_t i = 0; i < kKeyframes; ++i) {
      ASSERT_TRUE(*store->addKeyframe(idOf(i), i, messageOf(i)));
      ASSERT_TRUE(store->setPoses("m", {{idOf(i), poseOf(i)}}));
      tiles.push_back(tileOf("m", int(i), 0, 0, 20, i));
      if (i == 0) continue;
      ASSERT_TRUE(store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(i), Matrix6d::Identity()}));
      MatchVerdict verdict;
      verdict.query = idOf(i);
      verdict.candidate = idOf(0);
      verdict.reason = "overlap";
      ASSERT_TRUE(store->addVerdict(verdict));
    }
    ASSERT_TRUE(store->addMerge({1, "a", "b", poseOf(1), {"alpha"}, {idOf(1)}, 3, {}}));
    ASSERT_TRUE(store->setTiles(tiles));
  }
  std::vector<std::string> damageOf(size_t most_read = 200) {
    const auto glance = glanceAtStore(path_, most_read);
    EXPECT_TRUE(glance) << (glance ? "" : glance.error().text);
    return glance ? glance->damage : std::vector<std::string>{"no glance"};
  }
};

TEST_F(StoreGlanceTest, CountsAndSaysHowMuchItRead) {
  fill();
  const auto glance = glanceAtStore(path_, 7);
  ASSERT_TRUE(glance) << glance.error().text;
  EXPECT_THAT(glance->damage, IsEmpty());
  EXPECT_EQ(glance->keyframes, kKeyframes);
  EXPECT_EQ(glance->edges, kKeyframes - 1);
  EXPECT_EQ(glance->verdicts, kKeyframes - 1);
  EXPECT_EQ(glance->merges, 1u);
  EXPECT_EQ(glance->tiles, kKeyframes);
  EXPECT_EQ(glance->pictures_read, 7u);
  EXPECT_EQ(glance->tiles_read, 7u);
  EXPECT_EQ(glanceAtStore(path_)->pictures_read, kKeyframes);
}

TEST_F(StoreGlanceTest, WhatRowsNameIsLookedFor) {
  fill();
  sql("UPDATE edges SET to_sequence = 77 WHERE number = 3");
  EXPECT_THAT(damageOf(), ElementsAre(HasSubstr("edges: one names keyframe alpha/18364758544493064720/77, which")));
  sql("DELETE FROM edges WHERE number = 3; UPDATE verdicts SET candidate_robot = 'nobody' WHERE number < 30");
  const auto many = damageOf();
  ASSERT_EQ(many.size(), 21u);
  EXPECT_EQ(many.back(), "9 more of the same kind");
  sql("DELETE FROM verdicts; DELETE FROM keyframe_messages WHERE keyframe = 4");
  EXPECT_THAT(damageOf(), Contains(HasSubstr("/4: its message is not there")));
}

TEST_F(StoreGlanceTest, OfPicturesTheLastIsAmongThoseRead) {
  fill();
  sql("UPDATE keyframes SET crc32 = 5 WHERE arrival = 29");
  EXPECT_THAT(damageOf(3), ElementsAre(HasSubstr("keyframe 29: ")));
  sql("UPDATE tiles SET zstd = x'00' WHERE number = (SELECT max(number) FROM tiles)");
  EXPECT_THAT(damageOf(3), Contains(HasSubstr("tile 30: tile is damaged")));
}

TEST_F(StoreGlanceTest, NoStoreIsNoStore) {
  EXPECT_EQ(glanceAtStore(path_).error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(glanceAtStore(folder_).error().text, HasSubstr("is a folder"));
  std::ofstream(path_) << "not a database at all, but long enough to look at";
  EXPECT_EQ(glanceAtStore(path_).error().code, ErrorCode::kBadData);
}

TEST(KeyframeRuns, KnowsWhatASetKnows) {
  std::mt19937 engine(3);
  std::map<KeyframeId, uint32_t> all;
  KeyframeRuns runs;
  for (int i = 0; i < 4000; ++i) {
    const KeyframeId id{engine() % 2 == 0 ? "a" : "b", engine() % 2, uint32_t(engine() % 1500)};
    const uint32_t group = id.sequence / 400;
    if (!all.emplace(id, group).second) continue;
    runs.add(id, group);
  }
  for (const char* robot : {"a", "b", "c"})
    for (uint64_t session = 0; session < 3; ++session)
      for (uint32_t sequence = 0; sequence < 1600; ++sequence) {
        const KeyframeId id{robot, session, sequence};
        const auto known = all.find(id);
        EXPECT_EQ(runs.groupOf(id), known == all.end() ? std::nullopt : std::optional(known->second)) << toString(id);
      }
}

TEST(KeyframePlaces, KnowsWhereEachStands) {
  std::mt19937 engine(4);
  std::map<KeyframeId, uint32_t> all;
  std::vector<WholeKeyframe> keyframes;
  for (uint32_t i = 0; i < 4000; ++i) {
    // One session without gaps, one with many, one whose keyframes came in any order.
    const uint64_t session = engine() % 3;
    WholeKeyframe keyframe;
    keyframe.stored.id = {engine() % 2 == 0 ? "a" : "b", session,
                          session == 0   ? i
                          : session == 1 ? 7 * i + 3
                                         : uint32_t(engine() % 5000)};
    if (!all.emplace(keyframe.stored.id, uint32_t(keyframes.size())).second) continue;
    keyframes.push_back(keyframe);
  }
  const KeyframePlaces places(keyframes);
  for (const char* robot : {"a", "b", "c"})
    for (uint64_t session = 0; session < 4; ++session)
      for (uint32_t sequence = 0; sequence < 28100; ++sequence) {
        const KeyframeId id{robot, session, sequence};
        const auto known = all.find(id);
        ASSERT_EQ(places.placeOf(id), known == all.end() ? std::nullopt : std::optional(known->second)) << toString(id);
      }
  EXPECT_EQ(KeyframePlaces({}).placeOf({"a", 0, 0}), std::nullopt);
}

}  // namespace
}  // namespace comap
