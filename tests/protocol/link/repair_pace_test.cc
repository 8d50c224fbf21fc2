#include "protocol/link/repair_pace.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using namespace std::chrono_literals;

TEST(RepairPace, FollowsTheRoundTrip) {
  RepairPace pace;
  EXPECT_EQ(pace.choice(), 1u) << "as long as nothing is known";
  for (int i = 0; i < 4; ++i) pace.confirmed(20ms);
  EXPECT_EQ(pace.choice(), 0u);
  for (int i = 0; i < 4; ++i) pace.confirmed(300ms);
  EXPECT_EQ(pace.choice(), 1u);
  for (int i = 0; i < 4; ++i) pace.confirmed(10s);
  EXPECT_EQ(pace.choice(), 2u);
  for (int i = 0; i < 4; ++i) pace.confirmed(5ms);
  EXPECT_EQ(pace.choice(), 0u);
}

TEST(RepairPace, LossAloneDoesNotSlowItDown) {
  RepairPace pace;
  for (int i = 0; i < 40; ++i) pace.confirmed(i % 2 == 0 ? 40ms : 340ms);  // every other one is repaired
  EXPECT_EQ(pace.choice(), 0u);
}

TEST(RepairPace, DoesNotWaitForTheAnswerOfALinkThatIsFull) {
  RepairPace pace;
  for (int i = 0; i < 4; ++i) pace.confirmed(20ms);
  pace.waiting(150ms);
  EXPECT_EQ(pace.choice(), 0u);
  for (int since = 0; since <= 1500; since += 20) pace.waiting(RepairPace::Duration(since));
  EXPECT_EQ(pace.choice(), 2u);
}

TEST(RepairPace, DoesNotSwingAtABorder) {
  RepairPace pace;
  for (int i = 0; i < 4; ++i) pace.confirmed(110ms);
  EXPECT_EQ(pace.choice(), 1u);
  for (int i = 0; i < 4; ++i) pace.confirmed(90ms);
  EXPECT_EQ(pace.choice(), 1u);
  for (int i = 0; i < 4; ++i) pace.confirmed(70ms);
  EXPECT_EQ(pace.choice(), 0u);
}

}  // namespace
}  // namespace comap
