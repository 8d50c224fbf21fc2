#include "edge_agent/capture/pair_matcher.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

constexpr int64_t kMs = 1'000'000;

Picture at(int64_t ms) {
  Picture picture;
  picture.stamp_ns = ms * kMs;
  return picture;
}

PairMatcher matcher() { return PairMatcher(20 * kMs); }

// Stamps of the pair in milliseconds; {-1, -1} if there is none.
std::pair<int64_t, int64_t> take(PairMatcher& from) {
  EXPECT_EQ(from.hasPair(), from.hasPair());
  const bool had = from.hasPair();
  const auto pair = from.takeNewest();
  EXPECT_EQ(pair.has_value(), had);
  if (!pair) return {-1, -1};
  return {pair->colour.stamp_ns / kMs, pair->depth.stamp_ns / kMs};
}

using Pair = std::pair<int64_t, int64_t>;
constexpr Pair kNone{-1, -1};

TEST(PairMatcher, WaitsUntilNoDepthCanBeNearer) {
  PairMatcher m = matcher();
  m.addDepth(at(100));
  m.addColour(at(112));
  EXPECT_EQ(take(m), kNone) << "the period is not known: a depth picture of 113 may come";
  m.addDepth(at(133));
  EXPECT_EQ(take(m), Pair(112, 100));
  m.addDepth(at(166));
  m.addColour(at(170));
  EXPECT_EQ(take(m), Pair(170, 166)) << "the next is due at 199";
  m.addDepth(at(199));
  m.addColour(at(218));
  EXPECT_EQ(take(m), kNone) << "the next is due at 232, nearer than 199";
  m.addDepth(at(232));
  EXPECT_EQ(take(m), Pair(218, 232));
}

TEST(PairMatcher, WhatNeverPairsIsCountedAtOnce) {
  PairMatcher m = matcher();
  for (int64_t ms = 0; ms < 5000; ms += 1000) {
    m.addColour(at(ms));
    m.addDepth(at(ms + 30));
  }
  EXPECT_EQ(take(m), kNone);
  EXPECT_EQ(m.unpaired(), 5u);
}

TEST(PairMatcher, ColourMayComeFirst) {
  PairMatcher m = matcher();
  m.addColour(at(100));
  EXPECT_EQ(take(m), kNone);
  m.addDepth(at(95));
  EXPECT_EQ(take(m), kNone);
  m.addDepth(at(104));
  EXPECT_EQ(take(m), Pair(100, 104));
  EXPECT_EQ(take(m), kNone);
}

TEST(PairMatcher, TheNewestWinsAndTheOthersAreCounted) {
  PairMatcher m = matcher();
  for (int i = 0; i < 5; ++i) {
    m.addColour(at(100 + 33 * i));
    m.addDepth(at(102 + 33 * i));
  }
  EXPECT_EQ(take(m), Pair(232, 234));
  EXPECT_EQ(m.overtaken(), 4u);
  EXPECT_EQ(m.unpaired(), 0u);
  EXPECT_EQ(take(m), kNone);
}

TEST(PairMatcher, EachPictureIsUsedOnceAndTooFarIsNoPair) {
  PairMatcher m = matcher();
  m.addColour(at(100));
  m.addColour(at(133));
  m.addDepth(at(116));  // 16 from the first, 17 from the second
  m.addDepth(at(400));
  EXPECT_EQ(take(m), Pair(133, 116));
  m.addColour(at(166));
  m.addDepth(at(187));
  EXPECT_EQ(take(m), kNone);
  m.addColour(at(405));
  m.addDepth(at(410));
  EXPECT_EQ(take(m), Pair(405, 400));
  EXPECT_EQ(m.overtaken() + m.unpaired(), 2u);
}

TEST(PairMatcher, OneStreamAloneTakesNoMemoryAndIsCounted) {
  PairMatcher m = matcher();
  for (int i = 0; i < 1000; ++i) m.addColour(at(33 * i));
  EXPECT_GE(m.unpaired(), 980u);
  EXPECT_EQ(take(m), kNone);
  for (int i = 0; i < 1000; ++i) m.addDepth(at(33 * i + 100'000));
  EXPECT_EQ(take(m), kNone);
}

TEST(PairMatcher, RatesMayDiffer) {
  PairMatcher m = matcher();
  int pairs = 0;
  int64_t last = -1;
  for (int ms = 0; ms < 2000; ++ms) {
    if (ms % 33 == 0) m.addColour(at(ms));
    if (ms % 50 == 7) m.addDepth(at(ms));
    const Pair pair = take(m);
    if (pair == kNone) continue;
    ++pairs;
    EXPECT_GT(pair.first, last);
    EXPECT_LE(std::abs(pair.first - pair.second), 20);
    last = pair.first;
  }
  EXPECT_GE(pairs, 36) << "one for nearly each of 40 depth pictures";
}

}  // namespace
}  // namespace comap
