// The sender against a wire that loses, doubles, reorders and goes away.
#include "edge_agent/uplink/keyframe_sender.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "protocol/codec/message_checksum.h"
#include "tests/edge_agent/uplink/bad_wire.h"

namespace comap {
namespace {

class SenderLoss : public Sender, public testing::WithParamInterface<int> {};

TEST_P(SenderLoss, EveryKeyframeArrives) {
  wire_.loss_percent = GetParam();
  KeyframeSender sender = this->sender(7, quickly(), memoryOutbox());
  for (uint32_t i = 0; i < 200; ++i) {
    ASSERT_TRUE(sender.add(next(7, i)));
    now_ += 30ms;
    sender.sendDue(now_);
    wire_.tick(sender, now_);
  }
  deliver(sender);
  EXPECT_EQ(wire_.held.size(), 200u);
  EXPECT_EQ(wire_.trackers.at(7).state().next_expected, 200u);
}

INSTANTIATE_TEST_SUITE_P(LossPercent, SenderLoss, testing::Values(0, 5, 20, 60));

TEST_F(Sender, WhatEarlierLivesLeftComesAfterWhatThisOneSees) {
  for (const uint64_t session : {5u, 6u}) {
    KeyframeSender earlier = sender(session, quickly(), outboxAt(path_));
    wire_.there = 0;
    for (uint32_t i = 0; i < 20; ++i) {
      ASSERT_TRUE(earlier.add(next(session, i)));
      earlier.sendDue(now_);
    }
  }
  EXPECT_TRUE(wire_.order.empty()) << "nobody is there";
  wire_.there = 1;
  KeyframeSender present = sender(7, quickly(), outboxAt(path_));
  EXPECT_EQ(present.waiting(), 0u);
  EXPECT_EQ(present.waitingInAll(), 40u);
  for (uint32_t i = 0; i < 5; ++i) ASSERT_TRUE(present.add(next(7, i)));
  deliver(present);
  ASSERT_EQ(wire_.order.size(), 45u);
  for (uint32_t i = 0; i < 5; ++i) EXPECT_EQ(wire_.order[i], (OutboxKey{7, i}));
  for (uint32_t i = 0; i < 20; ++i) EXPECT_EQ(wire_.order[5 + i], (OutboxKey{6, i}));
  EXPECT_EQ(wire_.held.size(), 45u);
}

TEST_F(Sender, AfterAGapAllThatIsUnderWayGoesAgain) {
  KeyframeSender sender = this->sender(7, quickly(), memoryOutbox());
  wire_.loss_percent = 100;
  for (uint32_t i = 0; i < 10; ++i) ASSERT_TRUE(sender.add(next(7, i)));
  sender.sendDue(now_);
  wire_.there = 0;
  now_ += 10s;
  const size_t sent = wire_.order.size();
  sender.sendDue(now_);
  EXPECT_EQ(wire_.order.size(), sent);
  wire_.there = 1;
  wire_.loss_percent = 0;
  sender.sendDue(now_);
  EXPECT_GT(wire_.order.size(), sent);
  deliver(sender);
}

TEST_F(Sender, AFullOutboxThinsAndDropsAndTheCoreStillGetsOneChain) {
  SenderOptions options = quickly();
  wire_.there = 0;
  const uint64_t one = encodeKeyframe(next(7, 1))->size() + 1024;
  options.outbox_quota_bytes = 30 * one;
  KeyframeSender sender = this->sender(7, options, outboxAt(path_));
  for (uint32_t i = 0; i < 300; ++i) {
    // Now and then it finds back to a place of long ago, which may be gone.
    Keyframe keyframe = next(7, i);
    if (i % 50 == 49) {
      keyframe.linked_to = i / 2;
      keyframe.T_link_this =
          Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * i - 0.1 * keyframe.linked_to, 0, 0));
    }
    ASSERT_TRUE(sender.add(keyframe));
    EXPECT_LE(sender.waitingBytes(), options.outbox_quota_bytes + 3 * one);
  }
  EXPECT_GT(sender.losses().thinned, 0u);
  EXPECT_GT(sender.losses().dropped, 100u);
  EXPECT_EQ(sender.losses().dropped, 300 - sender.waiting());
  ASSERT_FALSE(log_.empty());
  EXPECT_NE(log_.front().find("outbox is full"), std::string::npos);
  EXPECT_LT(log_.size(), 30u);
  wire_.there = 1;
  std::vector<Keyframe> arrived;
  for (int i = 0; i < 20000 && sender.waitingInAll() > 0; ++i) {
    now_ += 10ms;
    sender.sendDue(now_);
    for (const Keyframe& keyframe : wire_.on_the_way) arrived.push_back(keyframe);
    wire_.tick(sender, now_);
  }
  EXPECT_EQ(wire_.trackers.at(7).state().next_expected, 300u) << "the core waits for nothing";
  for (const Keyframe& keyframe : arrived) {
    if (!keyframe.linked) {
      EXPECT_EQ(keyframe.id.sequence, 0u);
      continue;
    }
    EXPECT_TRUE(wire_.held.contains({"r", 7, keyframe.linked_to})) << keyframe.id.sequence;
    EXPECT_NEAR(keyframe.T_link_this.translation().x(), 0.1 * (keyframe.id.sequence - keyframe.linked_to), 1e-6);
  }
}

TEST_F(Sender, ADiskThatTakesNoMoreIsToldAndNothingIsLostWhileItLives) {
  auto outbox = Outbox::open(path_);
  ASSERT_TRUE(outbox);
  ASSERT_TRUE(outbox->limitBytes(100'000));  // as on a full disk: the file may not grow
  wire_.there = 0;
  KeyframeSender sender = this->sender(7, quickly(), std::move(*outbox));
  for (uint32_t i = 0; i < 40; ++i) ASSERT_TRUE(sender.add(next(7, i)));
  EXPECT_EQ(sender.waiting(), 40u);
  EXPECT_GT(sender.waitingInMemory(), 0u);
  EXPECT_LT(sender.waitingInMemory(), 40u);
  ASSERT_FALSE(log_.empty());
  EXPECT_NE(log_.front().find(path_), std::string::npos);
  EXPECT_NE(log_.front().find("in memory"), std::string::npos);
  wire_.there = 1;
  deliver(sender);
  EXPECT_EQ(wire_.held.size(), 40u);
  EXPECT_EQ(wire_.trackers.at(7).state().next_expected, 40u);
  ASSERT_TRUE(sender.add(next(7, 40)));
  EXPECT_EQ(sender.waitingInMemory(), 0u) << "there is room again";
}

TEST_F(Sender, AKeyframeThatTheCoreCannotTakeIsToldOnceStaysAndGoesAgainSeldom) {
  KeyframeSender sender = this->sender(7, quickly(), memoryOutbox());
  for (uint32_t i = 0; i < 3; ++i) ASSERT_TRUE(sender.add(next(7, i)));
  const auto second = messageChecksum(*encodeKeyframe(next(7, 1), 90));
  const auto refuse = [&] {
    Acknowledgement ack{"r", 7, 1, {2}, 0, ""};
    ack.refused = "keyframe: protocol major 2, this build speaks 1";
    ack.refused_checksum = second;
    sender.acknowledge(ack, now_);
  };
  const auto sentWithin = [&](std::chrono::seconds time) {
    wire_.order.clear();
    for (const auto end = now_ + time; now_ < end; now_ += 100ms) sender.sendDue(now_);
    return std::count(wire_.order.begin(), wire_.order.end(), OutboxKey{7, 1});
  };
  sender.sendDue(now_);
  EXPECT_EQ(sender.refused().size(), 0u);
  sentWithin(1s);
  refuse();
  EXPECT_EQ(sender.refused().size(), 1u);
  EXPECT_EQ(sender.waitingInAll(), 1u) << "it stays";
  ASSERT_EQ(sender.refusedToTell().size(), 1u);
  const RefusedKeyframe told = sender.refusedToTell().front();
  EXPECT_EQ(std::pair(told.session, told.sequence), (std::pair<uint64_t, uint32_t>(7, 1)));
  EXPECT_TRUE(told.link.linked);
  EXPECT_EQ(told.link.linked_to, 0u);
  EXPECT_EQ(sentWithin(59s), 0);
  wire_.order.clear();
  for (int i = 0; i < 20 && wire_.order.empty(); ++i, now_ += 100ms) sender.sendDue(now_);
  EXPECT_EQ(wire_.order, (std::vector<OutboxKey>{{7, 1}}));
  refuse();
  EXPECT_EQ(sentWithin(119s), 0) << "twice as long";
  ASSERT_TRUE(sender.add(next(7, 3)));
  sender.sendDue(now_);
  ASSERT_FALSE(wire_.order.empty());
  EXPECT_EQ(wire_.order.back(), (OutboxKey{7, 3})) << "others go on";
  EXPECT_EQ(std::count_if(log_.begin(), log_.end(),
                          [](const std::string& line) {
                            return line.find("the core refuses keyframe r/7/1: keyframe: protocol major 2") == 0;
                          }),
            1);
  sender.acknowledge({"r", 7, 1, {2, 3}, 0, ""}, now_);
  wire_.order.clear();
  wire_.there = 0;
  sender.sendDue(now_);
  wire_.there = 1;
  sender.sendDue(now_);
  EXPECT_EQ(wire_.order, (std::vector<OutboxKey>{{7, 1}})) << "another core may take it";
  EXPECT_TRUE(sender.refusedToTell().empty()) << "it has not refused it";
  sender.acknowledge({"r", 7, 4, {}, 0, ""}, now_);
  EXPECT_EQ(sender.refused().size(), 0u);
  EXPECT_EQ(sender.waitingInAll(), 0u);
  EXPECT_EQ(sender.refused().reason(), "");
}

TEST_F(Sender, WhatIsGivenUpIsToldToTheLast) {
  SenderLosses losses;
  {
    SenderOptions options = quickly();
    wire_.there = 0;
    options.outbox_quota_bytes = 10 * (encodeKeyframe(next(7, 1))->size() + 1024);
    KeyframeSender sender = this->sender(7, options, memoryOutbox());
    for (uint32_t i = 0; i < 60; ++i) ASSERT_TRUE(sender.add(next(7, i)));
    const size_t lines = log_.size();
    sender.tellLosses(Clock::now() + 31s);
    EXPECT_EQ(log_.size(), lines + 1);
    sender.tellLosses(Clock::now() + 99s);
    EXPECT_EQ(log_.size(), lines + 1) << "each once";
    const uint32_t dropped = sender.losses().dropped;
    for (uint32_t i = 60; i < 65; ++i) ASSERT_TRUE(sender.add(next(7, i)));
    ASSERT_GT(sender.losses().dropped, dropped);
    losses = sender.losses();
  }
  EXPECT_NE(log_.back().find("(" + std::to_string(losses.dropped) + " in all)"), std::string::npos) << log_.back();
  EXPECT_NE(log_.front().find(" kB)"), std::string::npos) << log_.front();
  uint32_t told = 0;
  for (const std::string& line : log_) {
    const size_t at = line.find("): ");
    ASSERT_NE(at, std::string::npos);
    std::istringstream parts(line.substr(at + 3));
    for (std::string part; std::getline(parts, part, ',');) told += static_cast<uint32_t>(std::stoul(part));
  }
  EXPECT_EQ(told, losses.thinned + losses.dropped);
}

TEST_F(Sender, MemoryDoesNotGrowWithTheBacklog) {
  {
    auto outbox = Outbox::open(path_);
    const auto encoded = *encodeKeyframe(next(5, 1));
    auto transaction = outbox->begin();
    for (uint32_t i = 0; i < 5000; ++i) ASSERT_TRUE(outbox->add(rowOf(next(5, i)), encoded));
    ASSERT_TRUE(transaction->commit());
  }
  KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
  EXPECT_EQ(sender.waitingInAll(), 5000u);
  for (int i = 0; i < 100; ++i) {
    now_ += 10ms;
    sender.sendDue(now_);
    wire_.on_the_way.clear();
  }
  EXPECT_LE(wire_.order.size(), 200u) << "a window's worth at a time, and its repeats";
}

}  // namespace
}  // namespace comap
