#include "protocol/session/ack_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace comap {
namespace {

TEST(AckTracker, CountsUpAndRemembersWhatIsBeyondAGap) {
  AckTracker tracker("r1", 7);
  EXPECT_EQ(tracker.state().next_expected, 0u);
  EXPECT_TRUE(tracker.record(0));
  EXPECT_TRUE(tracker.record(2));
  EXPECT_TRUE(tracker.record(5));
  EXPECT_FALSE(tracker.record(0));
  EXPECT_FALSE(tracker.record(5));
  const Acknowledgement state = tracker.state();
  EXPECT_EQ(state.robot, "r1");
  EXPECT_EQ(state.session, 7u);
  EXPECT_EQ(state.next_expected, 1u);
  EXPECT_EQ(state.also_held, (std::vector<uint32_t>{2, 5}));
  EXPECT_TRUE(state.refusal.empty());
  EXPECT_TRUE(tracker.record(1));
  EXPECT_EQ(tracker.state().next_expected, 3u);
  EXPECT_EQ(tracker.state().also_held, std::vector<uint32_t>{5});
}

TEST(AckTracker, OrderDoesNotMatter) {
  std::mt19937 random(1);
  std::vector<uint32_t> order(500);
  std::iota(order.begin(), order.end(), 0u);
  for (int round = 0; round < 20; ++round) {
    std::shuffle(order.begin(), order.end(), random);
    AckTracker tracker("r1", 7);
    for (const uint32_t sequence : order) {
      EXPECT_TRUE(tracker.record(sequence));
      EXPECT_FALSE(tracker.record(sequence));
    }
    EXPECT_EQ(tracker.state().next_expected, 500u);
    EXPECT_TRUE(tracker.state().also_held.empty());
  }
}

TEST(AckTracker, BeyondAGapThatStaysEachIsToldThatCameOfLate) {
  AckTracker tracker("r1", 7);
  const auto told = [&](uint32_t sequence) {
    const auto held = tracker.state().also_held;
    EXPECT_LE(held.size(), AckTracker::kMaxTold);
    EXPECT_TRUE(std::is_sorted(held.begin(), held.end()));
    return std::binary_search(held.begin(), held.end(), sequence);
  };
  for (uint32_t sequence = 1; sequence < 1000; ++sequence) {
    ASSERT_TRUE(tracker.record(sequence));
    ASSERT_TRUE(told(sequence));
  }
  EXPECT_FALSE(told(1));
  EXPECT_FALSE(tracker.record(1)) << "its robot has not heard and sends it again";
  EXPECT_TRUE(told(1));
  EXPECT_TRUE(tracker.record(0));
  EXPECT_EQ(tracker.state().next_expected, 1000u);
  EXPECT_TRUE(tracker.state().also_held.empty());
}

TEST(AckTracker, ASequenceFarAheadIsNotTaken) {
  AckTracker tracker("r1", 7);
  EXPECT_FALSE(tracker.accepts(0xffffffffu));
  EXPECT_FALSE(tracker.record(0xffffffffu));
  EXPECT_FALSE(tracker.record(AckTracker::kMaxAhead + 1));
  EXPECT_TRUE(tracker.record(AckTracker::kMaxAhead));
  EXPECT_EQ(tracker.state().also_held.size(), 1u);
}

}  // namespace
}  // namespace comap
