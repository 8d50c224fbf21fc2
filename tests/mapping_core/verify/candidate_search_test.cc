#include "mapping_core/verify/candidate_search.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

// A code of which the first `other` of 100 ferns differ from the code of 0.
FernCode code(size_t other) {
  FernCode code;
  code.book_hash = 7;
  code.codes.assign(100, 3);
  std::fill_n(code.codes.begin(), other, uint8_t{5});
  return code;
}

KeyframeId a(uint32_t i) { return {"alpha", 1, i}; }
KeyframeId b(uint32_t i) { return {"bravo", 1, i}; }

std::vector<KeyframeId> ids(const std::vector<Candidate>& candidates) {
  std::vector<KeyframeId> result;
  for (const Candidate& candidate : candidates) result.push_back(candidate.id);
  return result;
}

Kinship byRobot(const KeyframeId& other) { return other.robot == "alpha" ? Kinship::kOwn : Kinship::kForeign; }

TEST(CandidateSearch, foreignOnesComeFirstEachKindMostSimilarFirst) {
  CandidateSearch search({2, 1, 0.45, 20});
  ASSERT_TRUE(search.add(a(0), code(10)));
  ASSERT_TRUE(search.add(a(1), code(5)));
  for (uint32_t i = 0; i < 4; ++i) ASSERT_TRUE(search.add(b(i), code(30 - i)));
  const auto found = search.search(a(40), code(0), byRobot);
  EXPECT_EQ(ids(found), (std::vector{b(3), b(2), a(1)}));
  EXPECT_DOUBLE_EQ(found[0].dissimilarity, 0.27);
}

TEST(CandidateSearch, whatLooksTooDifferentIsNoCandidateAndNobodyIsAskedAboutIt) {
  CandidateSearch search({2, 2, 0.45, 20});
  for (uint32_t i = 0; i < 4; ++i) ASSERT_TRUE(search.add(b(i), code(44 + i)));
  size_t asked = 0;
  const auto found = search.search(a(0), code(0), [&](const KeyframeId& other) {
    ++asked;
    return byRobot(other);
  });
  EXPECT_EQ(ids(found), (std::vector{b(0), b(1)}));
  EXPECT_LE(asked, 4u);
}

TEST(CandidateSearch, neighboursInSequenceAreNoLoopsButOtherSessionsAre) {
  CandidateSearch search({0, 5, 0.45, 20});
  ASSERT_TRUE(search.add(a(20), code(0)));
  ASSERT_TRUE(search.add(a(21), code(0)));
  ASSERT_TRUE(search.add({"alpha", 2, 39}, code(0)));
  ASSERT_TRUE(search.add(a(40), code(0)));
  EXPECT_EQ(ids(search.search(a(40), code(0), byRobot)), (std::vector<KeyframeId>{a(20), {"alpha", 2, 39}}));
}

TEST(CandidateSearch, aKeyframeIsNoCandidateForItself) {
  CandidateSearch search({5, 5, 0.45, 0});
  for (const KeyframeId& id : {a(1), b(1)}) {
    ASSERT_TRUE(search.add(id, code(0)));
    for (const Candidate& candidate : search.search(id, code(0), byRobot)) EXPECT_NE(candidate.id, id);
  }
}

TEST(CandidateSearch, aCodeOfAnotherBookIsRefused) {
  CandidateSearch search({});
  ASSERT_TRUE(search.add(a(0), code(0)));
  FernCode other = code(0);
  other.book_hash = 8;
  EXPECT_FALSE(search.add(a(1), other));
}

}  // namespace
}  // namespace comap
