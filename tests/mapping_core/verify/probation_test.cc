#include "mapping_core/verify/probation.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

KeyframeId a(uint32_t i) { return {"alpha", 1, i}; }
KeyframeId b(uint32_t i) { return {"bravo", 1, i}; }

Pose shifted(double metres) { return Pose(Eigen::Quaterniond::Identity(), {metres, 0, 0}); }

// Two maps of six keyframes each, in one frame since merge 3.
class ProbationTest : public testing::Test {
 protected:
  ProbationTest() {
    for (uint32_t i = 0; i < 6; ++i) {
      T_map_cam_[a(i)] = Pose::exp((Vector6d() << 0.3 * i, 0, 0, 0, 0.1 * i, 0).finished());
      T_map_cam_[b(i)] = Pose::exp((Vector6d() << 0.3 * i, 0, 0.5, 0, 0.1 * i, 0).finished());
    }
  }
  Probation make() const {
    MergeSides sides;
    for (const auto& [id, T] : T_map_cam_) sides[id] = id.robot == "bravo";
    return Probation(3, sides, {closure(b(0), a(0)), closure(b(1), a(1))});
  }
  // What the map says of the two, wrong by `error` in the candidate's map.
  Closure closure(const KeyframeId& query, const KeyframeId& candidate, const Pose& error = {}) const {
    const Pose& T_map_candidate = T_map_cam_.at(candidate);
    return {query, candidate, T_map_candidate.inverse() * error * T_map_cam_.at(query), Matrix6d::Identity()};
  }
  std::string objection(const Probation& probation) const {
    return probation.objection(T_map_cam_, {}, {}).value_or("");
  }
  static Evidence views(size_t count, double contradicted) {
    Evidence evidence;
    evidence.views = count;
    evidence.cells = 1000 * count;
    evidence.through = static_cast<size_t>(contradicted * static_cast<double>(evidence.cells));
    return evidence;
  }

  std::map<KeyframeId, Pose> T_map_cam_;
};

TEST_F(ProbationTest, aKeyframeIsOfTheSideOfTheOneBeforeIt) {
  Probation probation = make();
  EXPECT_EQ(probation.sideOf(a(5)), false);
  EXPECT_EQ(probation.sideOf(b(5)), true);
  probation.follow(b(6), b(5));
  EXPECT_EQ(probation.sideOf(b(6)), true);
  probation.follow({"carol", 1, 1}, {"carol", 1, 0});
  EXPECT_FALSE(probation.sideOf({"carol", 1, 1}));
  EXPECT_TRUE(probation.between(closure(b(2), a(2))));
  EXPECT_FALSE(probation.between(closure(b(2), b(1))));
}

TEST_F(ProbationTest, endsWhenEnoughKeyframesHaveConfirmedTheMerge) {
  Probation probation = make();
  ProbationOptions options;
  options.witnesses = 2;
  probation.hear(b(2), {}, {});
  EXPECT_FALSE(probation.passed(options));
  EXPECT_EQ(probation.witnesses(), 0u) << "a keyframe that sees nothing of the other side is no witness";
  probation.hear(b(3), {{b(3), a(3)}}, views(2, 0));
  probation.hear(b(3), {{b(3), a(4)}}, views(2, 0));
  EXPECT_FALSE(probation.passed(options)) << "one keyframe, heard twice";
  probation.hear(a(3), {{a(3), b(3)}}, views(2, 0.001));
  EXPECT_TRUE(probation.passed(options));
  EXPECT_EQ(objection(probation), "");
  EXPECT_EQ(probation.compared().size(), 3u);
}

TEST_F(ProbationTest, viewsThatContradictAreAnObjectionOnceThereAreEnough) {
  Probation probation = make();
  probation.hear(b(2), {{b(2), a(2)}}, views(4, 0.05));
  EXPECT_EQ(objection(probation), "") << "too few to tell";
  probation.hear(b(3), {{b(3), a(3)}}, views(4, 0.05));
  EXPECT_EQ(
      objection(probation),
      "5.0 % of the surface that later keyframes of both maps see contradicts it, in 8 views; 2 of 2 keyframes see "
      "much that does");
  probation.rehear({{b(2), views(4, 0.002)}, {b(3), views(4, 0.002)}});
  EXPECT_EQ(objection(probation), "") << "poses have become better since";
}

// Two rooms that differ in one corner: it is in view of few keyframes, and drowns in what all the others see.
TEST_F(ProbationTest, fewKeyframesThatSeeMuchOfADifferenceAreAnObjection) {
  Probation probation = make();
  for (uint32_t i = 0; i < 8; ++i) probation.hear(a(10 + i), {{a(10 + i), b(3)}}, views(8, 0));
  for (uint32_t i = 0; i < 2; ++i) probation.hear(b(10 + i), {{b(10 + i), a(3)}}, views(4, 0.025));
  EXPECT_EQ(objection(probation), "") << "something was moved in view of two of them";
  probation.hear(b(12), {{b(12), a(3)}}, views(4, 0.025));
  EXPECT_LT(probation.evidence().contradicted(), ProbationOptions{}.contradicted);
  EXPECT_NE(objection(probation).find("3 of 11 keyframes see much that does"), std::string::npos);
  for (uint32_t i = 0; i < 8; ++i) probation.hear(a(20 + i), {{a(20 + i), b(3)}}, views(8, 0));
  EXPECT_EQ(objection(probation), "") << "so many others see nothing wrong";
}

TEST_F(ProbationTest, opposedClosuresMustAgreeWithEachOtherAndBeAsManyAsTheSupporters) {
  Probation probation = make();
  probation.oppose(closure(b(2), a(2), shifted(1)));
  EXPECT_EQ(objection(probation), "") << "one can be wrong";
  probation.oppose(closure(b(3), a(3), shifted(-1)));
  EXPECT_EQ(objection(probation), "") << "two that say different things as well";
  probation.oppose(closure(b(2), a(4), shifted(1)));
  EXPECT_EQ(objection(probation), "") << "and two that rest on one picture";
  Probation supported = probation;
  probation.oppose(closure(a(5), b(5), shifted(-1)));  // runs the other way, so it says the same
  EXPECT_EQ(objection(probation), "2 closures that agree with each other contradict it, 2 support it");
  supported.support(closure(b(4), a(4)));
  supported.oppose(closure(a(5), b(5), shifted(-1)));
  EXPECT_EQ(objection(supported), "") << "three support it";
}

TEST_F(ProbationTest, supportersThatRestOnOnePictureCountOnce) {
  Probation probation = make();
  EXPECT_EQ(probation.supporters(), 2u);
  probation.support(closure(b(0), a(4)));
  probation.support(closure(b(5), a(1)));
  EXPECT_EQ(probation.supporters(), 2u);
  probation.support(closure(b(5), a(4)));
  EXPECT_EQ(probation.supporters(), 3u);
}

}  // namespace
}  // namespace comap
