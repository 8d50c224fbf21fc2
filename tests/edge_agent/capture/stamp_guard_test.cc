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

TEST(StampGuard, OneWrongStampIsForgottenHoweverLongPicturesAreUnderWay) {
  for (const int64_t latency_ms : {5, 30, 40, 60, 100, 300}) {
    StampGuard guard;
    for (int64_t i = 0; i < 100; ++i) {
      const int64_t taken = kS + i * 33 * kMs, arrival = taken + (latency_ms + i % 3) * kMs;
      const auto stamp = guard.accept(i == 10 ? taken - 500 * kMs : taken, i, arrival);
      ASSERT_TRUE(stamp);
      EXPECT_NEAR(static_cast<double>(*stamp - taken), 0, 5.0 * kMs) << "picture " << i << ", " << latency_ms << " ms";
    }
    EXPECT_EQ(guard.jumps(), 1u) << latency_ms << " ms";
  }
}

TEST(StampGuard, PicturesThatWereHeldBackSpoilNoOthers) {
  StampGuard guard;
  constexpr int64_t kHeld_ms = 2500, kLatency_ms = 50;
  uint64_t believed = 0;
  for (int64_t i = 0; i < 120; i = i == 13 ? 86 : i + 1) {  // the four buffers of a driver, then what comes after
    const int64_t taken = kS + i * 33 * kMs;
    const bool held = i >= 10 && i <= 13;
    const auto stamp = guard.accept(taken, i, (held ? kS + 10 * 33 * kMs + kHeld_ms * kMs : taken) + kLatency_ms * kMs);
    ASSERT_TRUE(stamp);
    believed += *stamp == taken;
  }
  EXPECT_EQ(guard.jumps(), 4u);
  EXPECT_EQ(believed, 10u + 34u);
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
