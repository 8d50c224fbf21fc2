#include "protocol/session/outbox.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using namespace std::chrono_literals;
using Sequences = std::vector<uint32_t>;

const Outbox::Clock::time_point kStart{};

Acknowledgement ack(uint32_t next_expected, Sequences also_held = {}) {
  Acknowledgement ack;
  ack.robot = "r1";
  ack.session = 7;
  ack.next_expected = next_expected;
  ack.also_held = std::move(also_held);
  return ack;
}

Outbox filled(uint32_t count) {
  Outbox outbox("r1", 7);
  for (uint32_t i = 0; i < count; ++i)
    EXPECT_TRUE(outbox.add(i, std::vector<uint8_t>(10 + i, static_cast<uint8_t>(i))));
  return outbox;
}

TEST(Outbox, SendsAtMostAWindow) {
  Outbox outbox = filled(10);
  EXPECT_EQ(outbox.due(kStart, 4, 2s), (Sequences{0, 1, 2, 3}));
  EXPECT_EQ(outbox.due(kStart + 1s, 4, 2s), Sequences{});
  EXPECT_EQ(outbox.underWay(), 4u);
  EXPECT_EQ(outbox.acknowledge(ack(2)), 2u);
  EXPECT_EQ(outbox.due(kStart + 1s, 4, 2s), (Sequences{4, 5}));
  EXPECT_EQ(outbox.due(kStart + 1s, 5, 2s), Sequences{6});
}

TEST(Outbox, SendsAgainWhatIsNotAcknowledgedInTime) {
  Outbox outbox = filled(3);
  EXPECT_EQ(outbox.due(kStart, 2, 2s), (Sequences{0, 1}));
  EXPECT_EQ(outbox.due(kStart + 1999ms, 2, 2s), Sequences{});
  EXPECT_EQ(outbox.acknowledge(ack(0, {1})), 1u);
  EXPECT_EQ(outbox.due(kStart + 1999ms, 2, 2s), Sequences{2});
  EXPECT_EQ(outbox.due(kStart + 2s, 2, 2s), Sequences{0});
  EXPECT_EQ(outbox.due(kStart + 3999ms, 2, 2s), Sequences{2});
  EXPECT_EQ(outbox.due(kStart + 4s, 2, 2s), Sequences{0});
}

TEST(Outbox, AResendOutsideASmallerWindowStillGoes) {
  Outbox outbox = filled(4);
  EXPECT_EQ(outbox.due(kStart, 4, 1s).size(), 4u);
  EXPECT_EQ(outbox.due(kStart + 1s, 1, 1s), (Sequences{0, 1, 2, 3}));
}

TEST(Outbox, KeepsBytesUntilAcknowledged) {
  Outbox outbox = filled(3);
  EXPECT_EQ(outbox.bytes(), 33u);
  EXPECT_EQ(outbox.size(), 3u);
  ASSERT_EQ(outbox.encoded(2).size(), 12u);
  EXPECT_EQ(outbox.encoded(2)[0], 2);
  EXPECT_TRUE(outbox.encoded(3).empty());
  EXPECT_EQ(outbox.acknowledge(ack(1, {2})), 2u);
  EXPECT_EQ(outbox.bytes(), 11u);
  EXPECT_TRUE(outbox.encoded(0).empty());
  EXPECT_FALSE(outbox.empty());
  EXPECT_EQ(outbox.acknowledge(ack(3)), 1u);
  EXPECT_TRUE(outbox.empty());
  EXPECT_EQ(outbox.bytes(), 0u);
  EXPECT_EQ(outbox.underWay(), 0u);
}

TEST(Outbox, HearsOnlyWhatIsForThisSession) {
  Outbox outbox = filled(3);
  Acknowledgement other_session = ack(3), other_robot = ack(3), refused = ack(3);
  other_session.session = 8;
  other_robot.robot = "r2";
  refused.refusal = "another fern book";
  for (const auto& foreign : {other_session, other_robot, refused}) EXPECT_EQ(outbox.acknowledge(foreign), 0u);
  EXPECT_EQ(outbox.size(), 3u);
}

TEST(Outbox, AcknowledgedTwiceOrOutOfOrderIsHarmless) {
  Outbox outbox = filled(5);
  EXPECT_EQ(outbox.acknowledge(ack(4)), 4u);
  EXPECT_EQ(outbox.acknowledge(ack(2, {3, 4})), 1u);
  EXPECT_EQ(outbox.acknowledge(ack(4000000000u)), 0u);
}

TEST(Outbox, WhatTheLinkDidNotTakeIsDueAtOnce) {
  Outbox outbox = filled(3);
  EXPECT_EQ(outbox.due(kStart, 2, 2s), (Sequences{0, 1}));
  outbox.notSent(1);
  outbox.notSent(1);
  outbox.notSent(2);
  EXPECT_EQ(outbox.underWay(), 1u);
  EXPECT_EQ(outbox.due(kStart, 2, 2s), Sequences{1});
}

TEST(Outbox, RefusesASequenceTwice) {
  Outbox outbox = filled(3);
  EXPECT_FALSE(outbox.add(2, {}));
  EXPECT_EQ(outbox.acknowledge(ack(3)), 3u);
  const auto again = outbox.add(0, {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kWrongUse);
  EXPECT_EQ(again.error().text, "outbox: sequence 0 of robot 'r1', expected 3 or more");
  EXPECT_TRUE(outbox.add(3, {}));
}

}  // namespace
}  // namespace comap
