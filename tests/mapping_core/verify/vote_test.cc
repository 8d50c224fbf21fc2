#include "mapping_core/verify/vote.h"

#include <gtest/gtest.h>

#include <cmath>

namespace comap {
namespace {

KeyframeId a(uint32_t i) { return {"alpha", 1, i}; }
KeyframeId b(uint32_t i) { return {"bravo", 1, i}; }
KeyframeId c(uint32_t i) { return {"carol", 1, i}; }

// Three maps; that of bravo and of carol stand in alpha's as T_a_b and T_a_c say.
class VoteBoxTest : public testing::Test {
 protected:
  VoteBoxTest() {
    for (uint32_t i = 0; i < 8; ++i) {
      const double s = i;
      T_map_cam_[a(i)] = Pose::exp((Vector6d() << 0.3 * s, 0.1, 0.2 * s, 0, 0.2 * s, 0.05).finished());
      T_map_cam_[b(i)] = Pose::exp((Vector6d() << 0.4 * s, -0.2, 0.1 * s, 0.1, -0.15 * s, 0).finished());
      T_map_cam_[c(i)] = Pose::exp((Vector6d() << -0.2 * s, 0, 0.3 * s, 0, 0.1 * s, 0.1).finished());
    }
  }
  static bool together(const KeyframeId& one, const KeyframeId& two) { return one.robot == two.robot; }

  // What a perfect match of two keyframes says, disturbed by `error` at the query.
  Closure closure(const KeyframeId& query, const KeyframeId& candidate, const Pose& error = {}) const {
    const Pose T_candidate_query =
        T_map_cam_.at(candidate).inverse() * T_a(candidate).inverse() * T_a(query) * T_map_cam_.at(query) * error;
    return {query, candidate, T_candidate_query, Matrix6d::Identity() * (1 + query.sequence)};
  }
  auto cast(const Closure& closure) { return box_.cast(closure, together, T_map_cam_); }

  std::map<KeyframeId, Pose> T_map_cam_;
  VoteBox box_{VoteOptions{}};

 private:
  static Pose T_a(const KeyframeId& id) {
    if (id.robot == "bravo") return Pose::exp((Vector6d() << 4, 0.1, -2, 0.02, 1.2, 0).finished());
    if (id.robot == "carol") return Pose::exp((Vector6d() << -3, 0, 1, 0, -0.7, 0.01).finished());
    return {};
  }
};

Pose shifted(double metres) { return Pose(Eigen::Quaterniond::Identity(), {metres, 0, 0}); }
Pose turned(double degrees) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitY())), {0, 0, 0});
}

TEST_F(VoteBoxTest, oneClosureIsNotEnough) {
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_EQ(box_.pending(), 1u);
}

TEST_F(VoteBoxTest, twoThatAgreeAreEnoughAndLeaveTheBox) {
  EXPECT_FALSE(cast(closure(b(0), a(0), shifted(0.03))));
  const auto agreed = cast(closure(b(3), a(2), turned(1)));
  ASSERT_TRUE(agreed);
  ASSERT_EQ(agreed->size(), 2u);
  EXPECT_EQ((*agreed)[0].query, b(3)) << "itself first";
  EXPECT_EQ((*agreed)[1].query, b(0));
  EXPECT_EQ(box_.pending(), 0u);
  EXPECT_FALSE(cast(closure(b(5), a(5)))) << "the voters have left: counting starts again";
}

TEST_F(VoteBoxTest, oneQueryHasOneVote) {
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_FALSE(cast(closure(b(0), a(1))));
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_TRUE(cast(closure(b(1), a(1))));
}

TEST_F(VoteBoxTest, closuresThatShareAKeyframeAreOneVote) {
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_FALSE(cast(closure(b(1), a(0)))) << "both rest on a0";
  EXPECT_FALSE(cast(closure(a(0), b(2)))) << "and so does this, asked the other way";
}

TEST_F(VoteBoxTest, disagreeingOnesWaitApart) {
  EXPECT_FALSE(cast(closure(b(0), a(0), shifted(0.5))));
  EXPECT_FALSE(cast(closure(b(3), a(2), turned(20))));
  EXPECT_FALSE(cast(closure(b(5), a(4))));
  EXPECT_EQ(box_.pending(), 3u);
  const auto agreed = cast(closure(b(6), a(5)));
  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->size(), 2u);
  EXPECT_EQ((*agreed)[1].query, b(5));
  EXPECT_EQ(box_.pending(), 2u) << "those that were wrong stay";
}

TEST_F(VoteBoxTest, theLimitsOfAgreement) {
  EXPECT_FALSE(cast(closure(b(0), a(0), turned(5.5))));
  EXPECT_FALSE(cast(closure(b(0), a(1), shifted(0.11))));
  EXPECT_FALSE(cast(closure(b(2), a(2)))) << "5.5 degrees and 11 cm are too much";
  EXPECT_TRUE(cast(closure(b(0), a(3), shifted(0.05))));
}

TEST_F(VoteBoxTest, aReversedClosureCountsAndComesBackTurned) {
  EXPECT_FALSE(cast(closure(a(2), b(3))));
  const Closure last = closure(b(0), a(0));
  const auto agreed = cast(last);
  ASSERT_TRUE(agreed);
  ASSERT_EQ(agreed->size(), 2u);
  const Closure& turned_one = (*agreed)[1];
  EXPECT_EQ(turned_one.query, b(3));
  EXPECT_EQ(turned_one.candidate, a(2));
  const Closure expected = closure(b(3), a(2));
  EXPECT_LT((turned_one.T_candidate_query.matrix() - expected.T_candidate_query.matrix()).norm(), 1e-12);
  EXPECT_EQ(box_.pending(), 0u);
}

// The turned information must weigh the same small error as before.
TEST_F(VoteBoxTest, turnedInformationWeighsTheSameError) {
  Closure first = closure(a(2), b(3));
  Matrix6d root = Matrix6d::Identity() * 3;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) root(i, j) = 0.1 * (i + 1) - 0.2 * j;
  first.information = root * root.transpose();
  EXPECT_FALSE(cast(first));
  const auto agreed = cast(closure(b(0), a(0)));
  ASSERT_TRUE(agreed);
  const Closure& back = (*agreed)[1];
  const Vector6d xi = 1e-6 * (Vector6d() << 1, -2, 3, -1, 0.5, 2).finished();
  const Pose disturbed = Pose::exp(xi) * first.T_candidate_query;
  const Vector6d seen = (disturbed.inverse() * back.T_candidate_query.inverse()).log();
  const double before = xi.dot(first.information * xi), after = seen.dot(back.information * seen);
  EXPECT_NEAR(after / before, 1, 1e-4);
}

TEST_F(VoteBoxTest, onePairSeenFromBothEndsIsOneVote) {
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_FALSE(cast(closure(a(0), b(0))));
  EXPECT_TRUE(cast(closure(a(4), b(5))));
  EXPECT_EQ(box_.pending(), 0u) << "both ends of the pair leave";
}

TEST_F(VoteBoxTest, mapsDoNotVoteForEachOther) {
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_FALSE(cast(closure(c(1), a(1))));
  EXPECT_FALSE(cast(closure(b(2), c(2))));
  EXPECT_EQ(box_.pending(), 3u);
  const auto agreed = cast(closure(a(5), c(5)));
  ASSERT_TRUE(agreed);
  EXPECT_EQ((*agreed)[1].candidate, c(1)) << "turned into the new one's direction";
  EXPECT_EQ(box_.pending(), 2u);
}

TEST_F(VoteBoxTest, threeNeededAreThree) {
  VoteOptions options;
  options.needed = 3;
  box_ = VoteBox(options);
  EXPECT_FALSE(cast(closure(b(0), a(0))));
  EXPECT_FALSE(cast(closure(b(1), a(1))));
  const auto agreed = cast(closure(b(2), a(2)));
  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->size(), 3u);
}

}  // namespace
}  // namespace comap
