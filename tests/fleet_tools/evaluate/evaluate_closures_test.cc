#include "fleet_tools/evaluate/evaluate_closures.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

KeyframeId idOf(const std::string& robot, uint32_t sequence) { return {robot, 1, sequence}; }
Pose at(double x) { return Pose(Eigen::Quaterniond::Identity(), {x, 0, 0}); }

MatchVerdict verdictOf(const KeyframeId& query, const KeyframeId& candidate, const Pose& T_candidate_query,
                       bool accepted = true) {
  MatchVerdict verdict;
  verdict.query = query;
  verdict.candidate = candidate;
  verdict.accepted = accepted;
  verdict.reason = accepted ? "accepted" : "overlap";
  verdict.T_candidate_query = T_candidate_query;
  return verdict;
}

MergeRecord mergeOf(uint32_t number, const std::vector<KeyframeId>& voters, uint32_t ingested) {
  MergeRecord merge;
  merge.number = number;
  merge.voters = voters;
  merge.keyframes_ingested = ingested;
  return merge;
}

// Robot a at x = 0, 1, 2, robot b at 0.5, 1.5, 2.5; b's last one without truth.
class ClosureScoreTest : public testing::Test {
 protected:
  void SetUp() override {
    for (uint32_t i = 0; i < 3; ++i) {
      for (const std::string robot : {"a", "b"}) {
        const KeyframeId id = idOf(robot, i);
        truth_.order.push_back(id);
        truth_.stamp_s[id] = 2.0 * i;
        if (robot == "a" || i < 2) truth_.T_truth_cam[id] = at(i + (robot == "b" ? 0.5 : 0));
      }
    }
    truth_.overlapping = {{idOf("a", 0), idOf("b", 0)},
                          {idOf("a", 1), idOf("b", 0)},
                          {idOf("a", 1), idOf("b", 1)},
                          {idOf("a", 2), idOf("b", 1)}};
  }
  ClosureTruth truth_;
};

TEST_F(ClosureScoreTest, countsByHand) {
  const std::vector<MatchVerdict> verdicts = {
      verdictOf(idOf("b", 0), idOf("a", 0), at(0.5)),         // right
      verdictOf(idOf("a", 1), idOf("b", 0), at(0.59)),        // right: 9 cm off
      verdictOf(idOf("b", 1), idOf("a", 1), at(0.61)),        // wrong: 11 cm off
      verdictOf(idOf("b", 1), idOf("a", 0), at(1.5)),         // right, but no overlapping pair
      verdictOf(idOf("a", 2), idOf("a", 0), at(9)),           // one robot: not asked here
      verdictOf(idOf("b", 2), idOf("a", 2), at(7)),           // no truth
      verdictOf(idOf("a", 2), idOf("b", 1), at(0.5), false),  // refused
      verdictOf(idOf("b", 0), idOf("a", 0), at(0.5)),         // right, again
  };
  const ClosureScore score = scoreClosures(truth_, verdicts, {}, {});
  EXPECT_EQ(score.accepted, 5u);
  EXPECT_EQ(score.right, 4u);
  EXPECT_DOUBLE_EQ(*score.precision(), 0.8);
  EXPECT_EQ(score.pairs, 4u);
  EXPECT_EQ(score.pairs_found, 2u);
  // The later of each pair: b0, a1, b1, a2. b0, a1 and b1 (by its match with a0) have a right one.
  EXPECT_EQ(score.queries, 4u);
  EXPECT_EQ(score.queries_found, 3u);
  EXPECT_DOUBLE_EQ(*score.pairRecall(), 0.5);
  EXPECT_DOUBLE_EQ(*score.queryRecall(), 0.75);
}

TEST_F(ClosureScoreTest, aTurnTooFarIsWrong) {
  const auto turned = [](double degrees) {
    return at(0.5) * Pose(Eigen::Quaterniond(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitY())),
                          Eigen::Vector3d::Zero());
  };
  for (const double degrees : {4.9, 5.1}) {
    const ClosureScore score = scoreClosures(truth_, {verdictOf(idOf("b", 0), idOf("a", 0), turned(degrees))}, {}, {});
    EXPECT_EQ(score.right, degrees < 5 ? 1u : 0u);
  }
}

TEST_F(ClosureScoreTest, theFirstRightMergeAndFalseOnes) {
  const std::vector<MatchVerdict> verdicts = {verdictOf(idOf("b", 0), idOf("a", 0), at(3)),
                                              verdictOf(idOf("a", 1), idOf("b", 0), at(0.5)),
                                              verdictOf(idOf("b", 1), idOf("a", 1), at(0.5))};
  std::vector<MergeRecord> merges = {mergeOf(1, {idOf("b", 0), idOf("a", 1)}, 3),
                                     mergeOf(2, {idOf("a", 1), idOf("b", 1)}, 4), mergeOf(3, {idOf("b", 0)}, 6)};
  merges[2].undone = "contradicted";
  const ClosureScore score = scoreClosures(truth_, verdicts, merges, {});
  EXPECT_EQ(score.merges, 3u);
  EXPECT_EQ(score.false_merges, 2u);
  EXPECT_EQ(score.false_merges_standing, 1u);
  ASSERT_TRUE(score.first_merge_s);
  EXPECT_DOUBLE_EQ(*score.first_merge_s, 2.0);
  EXPECT_EQ(*score.first_merge_keyframes, 4u);
}

TEST_F(ClosureScoreTest, nothingAcceptedHasNoPrecision) {
  const ClosureScore score = scoreClosures(truth_, {}, {}, {});
  EXPECT_FALSE(score.precision());
  EXPECT_DOUBLE_EQ(*score.pairRecall(), 0);
  EXPECT_FALSE(score.first_merge_s);
  EXPECT_TRUE(toJson(score)["precision"].is_null());
}

// A wall 2 m ahead: its visible part is 2 m wide.
TEST(ClosureOverlap, aWallSeenFromTheSideByHalf) {
  const CameraModel camera{320, 320, 159.5, 119.5, 320, 240};
  const DepthImage wall(320, 240, static_cast<uint16_t>(2 * kDepthUnitsPerMetre));
  const CoarseView view = coarseView(camera, wall);
  EXPECT_DOUBLE_EQ(overlapOf(view, view, Pose()), 1);
  EXPECT_NEAR(overlapOf(view, view, at(1)), 0.5, 0.06);
  EXPECT_DOUBLE_EQ(overlapOf(view, view, at(3)), 0);
  EXPECT_DOUBLE_EQ(overlapOf(view, view, Pose(Eigen::Quaterniond::Identity(), {0, 0, 0.3})), 0) << "another surface";
  EXPECT_EQ(overlapOf(coarseView(camera, DepthImage(320, 240)), view, Pose()), 0) << "no depth, no overlap";
}

}  // namespace
}  // namespace comap
