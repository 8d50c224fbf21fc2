// Stores of which something is lost: what is whole is found, told apart from what is not, and saved.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include "mapping_core/store/store_glance.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/survey_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(StoreSurveyTest, AWholeStoreIsWholeAndIsSavedWhole) {
  fill();
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_THAT(survey->damage, IsEmpty());
  EXPECT_THAT(survey->remarks, IsEmpty());
  for (const StoreSurvey& one : {*survey, saved(*survey)}) {
    EXPECT_THAT(one.damage, IsEmpty());
    EXPECT_EQ(one.keyframes.size(), kKeyframes);
    EXPECT_EQ(one.edges.size(), kKeyframes - 1);
    EXPECT_EQ(one.verdicts.size(), kKeyframes - 2);
    EXPECT_EQ(one.merges.size(), 1u);
    EXPECT_EQ(one.meta.at("version"), "v");
  }
  EXPECT_EQ(survey->tiles, 6u);
}

TEST_F(StoreSurveyTest, NothingIsSavedOfMergesThatAreLost) {
  fill();
  {
    auto store = create();
    ASSERT_TRUE(store->setGivenAgain(store->merges()->front().number, 3));
    ASSERT_TRUE(store->setGivenAgain(77, 3));
    ASSERT_TRUE(store->setMeta("compact_due", "yes"));
  }
  const StoreSurvey again = saved(*surveyStore(path_));
  EXPECT_TRUE(again.meta.contains("merge_given_again_1"));
  EXPECT_FALSE(again.meta.contains("merge_given_again_77"));
  EXPECT_FALSE(again.meta.contains("compact_due"));
}

// A core that writes while its store is looked at: no edge without its keyframes is ever seen.
TEST_F(StoreSurveyTest, AStoreThatIsWrittenMeanwhileIsWhole) {
  fill();
  std::atomic<bool> stop = false;
  auto store = create();
  std::thread core([&] {
    for (uint32_t i = kKeyframes; !stop; ++i) {
      auto together = store->begin();
      (void)bool(store->addKeyframe(idOf(i), i, messageOf(i)));
      (void)bool(store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(i), Matrix6d::Identity()}));
      (void)bool(together->commit());
    }
  });
  for (int round = 0; round < 30; ++round) {
    EXPECT_THAT(surveyStore(path_)->damage, IsEmpty());
    EXPECT_THAT(glanceAtStore(path_)->damage, IsEmpty());
  }
  stop = true;
  core.join();
}

// SQLite itself would never write such rows; a damaged page can hold them.
TEST_F(StoreSurveyTest, ValuesOfAnotherTypeAreNotSaved) {
  fill();
  std::string damaged = contentOf(path_);
  // An edge's record: its header has a byte for its own length, one for each type and one more for that of the numbers;
  // that of `merge`, a 0 that takes no further bytes, becomes NULL.
  constexpr size_t kHeaderBytes = 14;
  const size_t kind = damaged.find("odometryalpha");
  ASSERT_NE(kind, std::string::npos);
  ASSERT_EQ(static_cast<size_t>(damaged[kind - kHeaderBytes]), kHeaderBytes);
  ASSERT_EQ(damaged.substr(kind - 3, 2), "\x08\x08");
  damaged[kind - 3] = 0;
  std::ofstream(path_, std::ios::binary) << damaged;
  for (const SurveyDepth depth : {SurveyDepth::kRows, SurveyDepth::kPages}) {
    const auto survey = surveyStore(path_, {}, depth);
    ASSERT_TRUE(survey) << survey.error().text;
    EXPECT_THAT(survey->damage, Contains(HasSubstr("a value of it is of another type than its column")));
    EXPECT_EQ(survey->edges.size(), kKeyframes - 2);
    const StoreSurvey again = saved(*survey);
    EXPECT_THAT(again.damage, IsEmpty());
    EXPECT_EQ(again.edges.size(), kKeyframes - 1) << "the tie stands in the keyframe's message too";
  }
}

TEST_F(StoreSurveyTest, NumbersThatAreNoneAreNotSaved) {
  fill();
  sql("UPDATE poses SET qx = 9e999 WHERE keyframe = 3; UPDATE poses SET tx = NULL WHERE keyframe = 4;"
      "UPDATE edges SET numbers = zeroblob(55) WHERE number = 2");
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_THAT(survey->damage, Contains(HasSubstr("pose of keyframe 3")));
  EXPECT_THAT(survey->damage, Contains(HasSubstr("edge 2: ")));
  EXPECT_EQ(survey->keyframes.size(), kKeyframes);
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  const auto store = MapStore::open(folder_ / "saved.comap", MapStore::Mode::kReadOnly);
  ASSERT_TRUE(store);
  EXPECT_TRUE(store->keyframes()) << "what is saved can be read";
}

TEST_F(StoreSurveyTest, DamageAndGapsAreNamed) {
  fill();
  sql("UPDATE keyframe_messages SET encoded = zeroblob(length(encoded)) WHERE keyframe = 3;"
      "DELETE FROM keyframe_messages WHERE keyframe = 5;"
      "DELETE FROM keyframes WHERE arrival = 7;"
      "UPDATE edges SET numbers = zeroblob(4) WHERE number = 1;"
      "UPDATE tiles SET zstd = zeroblob(20) WHERE number = 2;");
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  const std::string session = "alpha/18364758544493064720/";
  for (const std::string& text : {"keyframe 3: " + session + "3, its message is damaged (checksum)",
                                  "keyframe " + session + "5: its message is not there",
                                  "keyframe " + session + "7: its row is lost, its message is whole",
                                  std::string("edge 1: a pose's quaternion has length"), std::string("tile 2: "),
                                  "names keyframe " + session + "5, which is not there or not whole"})
    EXPECT_THAT(survey->damage, Contains(HasSubstr(text)));
  EXPECT_EQ(survey->keyframes.size(), kKeyframes - 2);
  EXPECT_EQ(survey->tiles, 5u);
  ASSERT_FALSE(survey->edges.runs().empty());
  EXPECT_EQ(survey->edges.runs().front().first, 2) << "the first edge is damaged";
  EXPECT_THAT(survey->remarks, Contains(HasSubstr("sequences 3 to 3 are not there")));
  EXPECT_THAT(survey->remarks, Contains(HasSubstr("sequences 5 to 5 are not there")));
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  EXPECT_EQ(again.keyframes.size(), kKeyframes - 2);
}

// Keyframe 2 was refused, or is lost; the others go on in steps of 0.1 m. The table of edges is empty.
class StoreWithAGap : public StoreSurveyTest {
 protected:
  void fillBut(const MapId& map_behind, const Pose& T_odom_jump) {
    auto store = create();
    ASSERT_TRUE(store);
    for (const uint32_t i : {0, 1, 3, 4}) {
      const Pose T(Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0});
      ASSERT_TRUE(*store->addKeyframe(idOf(i), i, messageOf(i, i > 2 ? T_odom_jump * T : T)));
      ASSERT_TRUE(store->setPoses(i > 2 ? map_behind : "m", {{idOf(i), T}}));
    }
  }
  std::vector<Edge> savedEdges() {
    saved(*surveyStore(path_));
    const auto store = MapStore::open(folder_ / "saved.comap", MapStore::Mode::kReadOnly);
    const auto edges = store->edges();
    return edges ? *edges : std::vector<Edge>();
  }
};

TEST_F(StoreWithAGap, IsTiedAcrossItAsTheMapStood) {
  fillBut("m", Pose());
  const auto edges = savedEdges();
  ASSERT_EQ(edges.size(), 3u);
  const auto across = std::find_if(edges.begin(), edges.end(), [](const Edge& edge) { return edge.to == idOf(3); });
  ASSERT_NE(across, edges.end());
  EXPECT_EQ(across->from, idOf(1));
  EXPECT_EQ(across->kind, EdgeKind::kOdometry);
  EXPECT_NEAR(across->T_from_to.translation().x(), 0.2, 1e-6);
  EXPECT_NEAR(across->information(0, 0), 0.5, 1e-6) << "of two ties";
}

TEST_F(StoreWithAGap, StaysApartWhereTheMapWasInTwo) {
  fillBut("n", Pose());
  EXPECT_EQ(savedEdges().size(), 2u);
}

TEST_F(StoreWithAGap, StaysApartWhereOdometrySaysSomethingElse) {
  fillBut("m", Pose(Eigen::Quaterniond::Identity(), {0.3, 0, 0}));
  EXPECT_EQ(savedEdges().size(), 2u);
}

TEST_F(StoreSurveyTest, WhatIsNoStoreIsRefused) {
  EXPECT_EQ(surveyStore(path_).error().code, ErrorCode::kUnreachable);
  std::ofstream(path_) << "no store";
  EXPECT_EQ(surveyStore(path_).error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace comap
