#include "mapping_core/ingest/robot_registry.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::seconds;

constexpr uint64_t kBook = 0xB00C;

TEST(RobotRegistry, ServesWhoSaidHelloWithTheRightBook) {
  RobotRegistry registry(kBook);
  EXPECT_EQ(registry.served("a", 1), nullptr);
  EXPECT_TRUE(registry.admit({"a", 1, kBook, "x"}).refusal.empty());
  ASSERT_NE(registry.served("a", 1), nullptr);
  EXPECT_EQ(registry.served("a", 2), nullptr);
  EXPECT_EQ(registry.served("b", 1), nullptr);
}

TEST(RobotRegistry, RefusesAnotherFernBookWithTheReason) {
  RobotRegistry registry(kBook);
  const RobotRecord& record = registry.admit({"a", 1, kBook + 1, "x"});
  EXPECT_NE(record.refusal.find("fern book"), std::string::npos);
  EXPECT_EQ(registry.served("a", 1), nullptr);
  EXPECT_TRUE(registry.refuses("a", Clock::now()));
  EXPECT_EQ(acknowledgementOf(record).refusal, record.refusal);
}

TEST(RobotRegistry, AskingAgainKeepsWhatIsKnownAndANewSessionStartsAfresh) {
  RobotRegistry registry(kBook);
  registry.admit({"a", 1, kBook, "x"}).acks.record(0);
  EXPECT_EQ(acknowledgementOf(registry.admit({"a", 1, kBook, "x"})).next_expected, 1u);
  const Acknowledgement ack = acknowledgementOf(registry.admit({"a", 2, kBook, "x"}));
  EXPECT_EQ(ack.next_expected, 0u);
  EXPECT_EQ(ack.session, 2u);
  EXPECT_EQ(registry.served("a", 1), nullptr);
}

TEST(RobotRegistry, KeyframesOfEarlierSessionsAreTakenAndAcknowledged) {
  RobotRegistry registry(kBook);
  EXPECT_EQ(registry.delivering("a", 1), nullptr) << "it has not said hello";
  registry.admit({"a", 2, kBook, "x"}).acks.record(0);
  registry.admit({"a", 5, kBook, "x"});
  ASSERT_NE(registry.delivering("a", 2), nullptr);
  EXPECT_EQ(acknowledgementOf(*registry.delivering("a", 2)).next_expected, 1u);
  ASSERT_NE(registry.delivering("a", 3), nullptr) << "of a start that no core saw";
  registry.delivering("a", 3)->acks.record(0);
  EXPECT_EQ(acknowledgementOf(*registry.delivering("a", 3)).next_expected, 1u);
  EXPECT_EQ(acknowledgementOf(*registry.delivering("a", 3)).session, 3u);
  EXPECT_EQ(registry.delivering("a", 6), nullptr);
  EXPECT_EQ(registry.served("a", 2), nullptr) << "but the robot is where its present session says";
  registry.admit({"a", 6, kBook + 1, "x"});
  EXPECT_EQ(registry.delivering("a", 2), nullptr);
}

// Its book is set right, and what its outbox kept meanwhile comes.
TEST(RobotRegistry, KeyframesOfAStartThatWasRefusedAreTakenAndAcknowledgedLater) {
  RobotRegistry registry(kBook);
  EXPECT_FALSE(registry.admit({"a", 1, kBook + 1, "x"}).refusal.empty());
  EXPECT_TRUE(registry.admit({"a", 2, kBook, "x"}).refusal.empty());
  ASSERT_NE(registry.delivering("a", 1), nullptr);
  registry.delivering("a", 1)->acks.record(0);
  const Acknowledgement ack = acknowledgementOf(*registry.delivering("a", 1));
  EXPECT_EQ(ack.next_expected, 1u);
  EXPECT_EQ(ack.refusal, "");
}

TEST(RobotRegistry, OfTwoLiveRobotsOfOneNameTheFirstKeepsItAndTheSecondIsToldWhy) {
  RobotRegistry registry(kBook);
  const Clock::time_point start = Clock::time_point() + seconds(1000);
  registry.admit({"a", 1, kBook, "x"});
  EXPECT_EQ(registry.alive("a", 1, start), nullptr);
  registry.admit({"a", 2, kBook, "x"});
  const RobotRecord* refused = nullptr;
  for (int s = 1; s <= 6 && refused == nullptr; ++s) {
    EXPECT_EQ(registry.alive("a", 2, start + seconds(s)), nullptr);
    refused = registry.alive("a", 1, start + seconds(s));
  }
  ASSERT_NE(refused, nullptr);
  EXPECT_EQ(refused->session, 2u);
  EXPECT_TRUE(registry.refuses("a", start + seconds(60)));
  EXPECT_FALSE(registry.refuses("a", start + seconds(600))) << "it was told, and is gone";
  EXPECT_FALSE(registry.refuses("b", start + seconds(60)));
  EXPECT_NE(acknowledgementOf(*refused).refusal.find("another robot named 'a'"), std::string::npos);
  EXPECT_NE(registry.served("a", 1), nullptr);
  EXPECT_EQ(registry.served("a", 2), nullptr);
  EXPECT_FALSE(registry.admit({"a", 2, kBook, "x"}).refusal.empty()) << "also when it asks again";
  EXPECT_NE(registry.served("a", 1), nullptr);
  EXPECT_EQ(registry.alive("a", 2, start + seconds(500)), nullptr);
  EXPECT_TRUE(registry.refuses("a", start + seconds(600))) << "it was not gone";
  EXPECT_TRUE(registry.admit({"a", 3, kBook, "x"}).refusal.empty()) << "a new start may be its successor";
}

// Its session's number says nothing: the second robot's clock may be behind.
TEST(RobotRegistry, WhatTheSecondHasDeliveredStaysAndNothingMoreIsTaken) {
  for (const uint64_t second : {2, 9}) {
    RobotRegistry registry(kBook);
    const Clock::time_point start = Clock::time_point() + seconds(1000);
    registry.admit({"a", 5, kBook, "x"});
    registry.alive("a", 5, start);
    registry.admit({"a", second, kBook, "x"});
    for (uint32_t sequence : {0, 1, 2}) registry.delivering("a", second)->acks.record(sequence);
    const RobotRecord* refused = nullptr;
    for (int s = 1; s <= 6 && refused == nullptr; ++s) {
      EXPECT_EQ(registry.alive("a", second, start + seconds(s)), nullptr);
      refused = registry.alive("a", 5, start + seconds(s));
    }
    ASSERT_NE(refused, nullptr);
    EXPECT_NE(acknowledgementOf(*refused).refusal.find("what it has delivered (3 keyframes) stays in the map"),
              std::string::npos)
        << acknowledgementOf(*refused).refusal;
    EXPECT_EQ(registry.delivering("a", second), nullptr) << second;
    EXPECT_NE(registry.delivering("a", 5), nullptr);
  }
}

TEST(RobotRegistry, ALateWordOfAnEarlierLifeIsNoSecondRobot) {
  RobotRegistry registry(kBook);
  const Clock::time_point start = Clock::time_point() + seconds(1000);
  registry.admit({"a", 1, kBook, "x"});
  registry.admit({"a", 2, kBook, "x"});
  EXPECT_EQ(registry.alive("a", 2, start), nullptr);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(registry.alive("a", 1, start + seconds(1)), nullptr);
  EXPECT_EQ(registry.alive("a", 1, start + seconds(20)), nullptr) << "one word alone";
  EXPECT_NE(registry.served("a", 2), nullptr);
}

}  // namespace
}  // namespace comap
