#include "edge_agent/capture/stamp_guard.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

constexpr int64_t kMs = 1'000'000, kS = 1000 * kMs;

TEST(StampGuard, BelievesWhatCanBe) {
  StampGuard guard;
  for (int64_t i = 0; i < 5; ++i)
    EXPECT_EQ(guard.accept(kS + i * 33 * kMs, i, kS + i * 33 * kMs + 20 * kMs), kS + i * 33 * kMs);
  EXPECT_EQ(guard.jumps(), 0u);
  EXPECT_EQ(guard.missed(), 0u);
}

TEST(StampGuard, ARepeatedPictureIsNone) {
  StampGuard guard;
  EXPECT_EQ(guard.accept(kS, 0, kS), kS);
  EXPECT_EQ(guard.accept(kS, 1, kS + 33 * kMs), std::nullopt);
  EXPECT_EQ(guard.accept(kS, 2, kS + 66 * kMs), std::nullopt);
  EXPECT_EQ(guard.repeated(), 2u);
  EXPECT_EQ(guard.accept(kS + 99 * kMs, 3, kS + 100 * kMs), kS + 99 * kMs);
}

TEST(StampGuard, JumpsGiveWayToTheTimeOfArrival) {
  StampGuard guard;
  EXPECT_EQ(guard.accept(10 * kS, 0, 10 * kS), 10 * kS);
  EXPECT_EQ(guard.accept(500 * kS, 1, 10 * kS + 33 * kMs), 10 * kS + 33 * kMs);            // into the future
  EXPECT_EQ(guard.accept(1 * kS, 2, 10 * kS + 66 * kMs), 10 * kS + 66 * kMs);              // far back
  EXPECT_EQ(guard.accept(10 * kS + 50 * kMs, 3, 10 * kS + 99 * kMs), 10 * kS + 99 * kMs);  // before the one before
  EXPECT_EQ(guard.jumps(), 3u);
  EXPECT_EQ(guard.accept(10 * kS + 130 * kMs, 4, 10 * kS + 132 * kMs), 10 * kS + 130 * kMs);  // good again
  EXPECT_EQ(guard.jumps(), 3u);
}

TEST(StampGuard, StampsGrowEvenIfNothingElseDoes) {
  StampGuard guard;
  int64_t last = 0;
  for (int i = 0; i < 5; ++i) {
    const auto stamp = guard.accept(0, 0, kS);
    ASSERT_TRUE(stamp);
    EXPECT_GT(*stamp, last);
    last = *stamp;
  }
}

TEST(StampGuard, CountsWhatNeverCame) {
  StampGuard guard;
  guard.accept(1 * kMs, 5, 1 * kMs);
  guard.accept(2 * kMs, 6, 2 * kMs);
  guard.accept(3 * kMs, 9, 3 * kMs);
  EXPECT_EQ(guard.missed(), 2u);
  guard.accept(4 * kMs, 0, 4 * kMs);  // counts anew
  guard.accept(5 * kMs, 4'000'000'000, 5 * kMs);
  EXPECT_EQ(guard.missed(), 2u);
}

}  // namespace
}  // namespace comap
