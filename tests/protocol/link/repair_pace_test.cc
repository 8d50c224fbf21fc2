#include "protocol/link/repair_pace.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using namespace std::chrono_literals;

TEST(RepairPace, FollowsTheRoundTrip) {
  RepairPace pace;
  EXPECT_EQ(pace.period(), RepairPace::kFirst);
  for (int i = 0; i < 4; ++i) pace.confirmed(20ms);
  EXPECT_EQ(pace.period(), RepairPace::kShortest);
  for (int i = 0; i < 4; ++i) pace.confirmed(1000ms);
  EXPECT_EQ(pace.period(), 1500ms);
  for (int i = 0; i < 4; ++i) pace.confirmed(10s);
  EXPECT_EQ(pace.period(), RepairPace::kLongest);
  for (int i = 0; i < 4; ++i) pace.confirmed(5ms);
  EXPECT_EQ(pace.period(), RepairPace::kShortest);
}

TEST(RepairPace, LossAloneDoesNotSlowItDown) {
  RepairPace pace;
  for (int i = 0; i < 40; ++i) pace.confirmed(i % 2 == 0 ? 40ms : 340ms);  // every other one is repaired
  EXPECT_EQ(pace.period(), RepairPace::kShortest);
}

TEST(RepairPace, DoesNotWaitForTheAnswerOfALinkThatIsFull) {
  RepairPace pace;
  for (int i = 0; i < 4; ++i) pace.confirmed(20ms);
  pace.waiting(150ms);
  EXPECT_EQ(pace.period(), RepairPace::kShortest);
  for (int since = 0; since <= 1000; since += 20) pace.waiting(RepairPace::Duration(since));
  EXPECT_GE(pace.period(), 500ms);
}

TEST(RepairPace, SmallChangesAreNone) {
  RepairPace pace;
  for (int i = 0; i < 4; ++i) pace.confirmed(400ms);
  const auto before = pace.period();
  for (int i = 0; i < 4; ++i) pace.confirmed(450ms);
  EXPECT_EQ(pace.period(), before);
}

}  // namespace
}  // namespace comap
