#include "mapping_core/ingest/robot_registry.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

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

}  // namespace
}  // namespace comap
