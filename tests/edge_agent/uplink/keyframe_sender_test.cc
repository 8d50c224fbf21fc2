// The sender against a wire that loses, doubles, reorders and goes away, and a disk that fails.
#include "edge_agent/uplink/keyframe_sender.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <random>
#include <set>
#include <sstream>

#include "protocol/codec/message_checksum.h"
#include "protocol/session/ack_tracker.h"
#include "tests/edge_agent/uplink/keyframes.h"
#include "tests/files/damaged_database.h"

namespace comap {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// A core at the other end of a bad wire.
class BadWire final : public Link {
 public:
  Result<void> publish(Topic, const std::string&, std::span<const uint8_t> payload) override {
    const auto keyframe = decodeKeyframeWithoutImages(payload);
    EXPECT_TRUE(keyframe);
    order.push_back({keyframe->id.session, keyframe->id.sequence});
    for (int copies = chance(10) ? 2 : 1; copies > 0; --copies)
      if (!chance(loss_percent)) on_the_way.push_back(*keyframe);
    return {};
  }
  bool delivered(Topic, const std::string&) const override { return true; }
  std::optional<Delivery> receive(std::chrono::milliseconds) override { return std::nullopt; }
  int peers() const override { return there; }

  // Some of what is on the way arrives, in any order; the answers, too.
  void tick(KeyframeSender& sender, Clock::time_point now) {
    std::shuffle(on_the_way.begin(), on_the_way.end(), random);
    while (!on_the_way.empty() && chance(70)) {
      const Keyframe& keyframe = on_the_way.back();
      auto& tracker = trackers.try_emplace(keyframe.id.session, "r", keyframe.id.session).first->second;
      for (uint32_t i = 0; i < keyframe.skipped; ++i) tracker.record(keyframe.id.sequence - 1 - i);
      tracker.record(keyframe.id.sequence);
      held.insert(keyframe.id);
      on_the_way.pop_back();
      if (!chance(loss_percent)) answers.push_back(tracker.state());
    }
    std::shuffle(answers.begin(), answers.end(), random);
    while (!answers.empty() && chance(70)) {
      sender.acknowledge(answers.back(), now);
      answers.pop_back();
    }
  }
  bool chance(int percent) { return static_cast<int>(random() % 100) < percent; }

  int loss_percent = 0, there = 1;
  std::mt19937 random{3};
  std::vector<OutboxKey> order;
  std::vector<Keyframe> on_the_way;
  std::vector<Acknowledgement> answers;
  std::map<uint64_t, AckTracker> trackers;
  std::set<KeyframeId> held;
};

SenderOptions quickly() {
  SenderOptions options;
  options.send.resend_after = 100ms;
  options.send.budget_bytes_per_s = 0;
  return options;
}

class Sender : public testing::Test {
 protected:
  KeyframeSender sender(uint64_t session, const SenderOptions& options, Outbox outbox) {
    return KeyframeSender(wire_, "r", session, options, std::move(outbox),
                          [this](const std::string& line) { log_.push_back(line); });
  }
  void deliver(KeyframeSender& sender) {
    for (int i = 0; i < 20000 && sender.waitingInAll() > 0; ++i) {
      now_ += 10ms;
      sender.sendDue(now_);
      wire_.tick(sender, now_);
    }
    EXPECT_EQ(sender.waitingInAll(), 0u);
  }
  static Keyframe next(uint64_t session, uint32_t sequence) {
    return keyframeAt(session, sequence, 0.1 * sequence, 0.1 * sequence - 0.1);
  }

  ScratchFolder folder_;
  const std::string path_ = folder_.file("r.outbox");
  BadWire wire_;
  std::vector<std::string> log_;
  Clock::time_point now_ = Clock::time_point() + 1h;
};

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

// The disk takes not even a deletion: no file of this process may grow, as on a disk that others have filled.
class FullDisk {
 public:
  explicit FullDisk(const std::string& log) {
    getrlimit(RLIMIT_FSIZE, &before_);
    signal_ = std::signal(SIGXFSZ, SIG_IGN);
    rlimit now = before_;
    now.rlim_cur = std::filesystem::exists(log) ? std::filesystem::file_size(log) : 0;
    setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*signal_)(int) = nullptr;
};

class OnFullDisk : public Sender {
 protected:
  static void addTo(KeyframeSender& sender, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) EXPECT_TRUE(sender.add(next(7, i)));
  }
};

TEST_F(OnFullDisk, WhatTheCoreHoldsCountsNoMoreThoughItCannotBeTakenOut) {
  {
    KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
    addTo(sender, 5);
    {
      const FullDisk full(path_ + "-wal");
      for (uint32_t i = 5; i < 8; ++i) ASSERT_TRUE(sender.add(next(7, i)));
      EXPECT_EQ(sender.waitingInMemory(), 3u);
      deliver(sender);
      EXPECT_EQ(wire_.held.size(), 8u);
      EXPECT_EQ(sender.deliveredButThere(), 5u);
      EXPECT_EQ(sender.waitingBytes(), 0u);
      const size_t sent = wire_.order.size();
      for (int i = 0; i < 100; ++i) sender.sendDue(now_ += 100ms);
      EXPECT_EQ(wire_.order.size(), sent) << "none of them goes again";
      sender.tryDisk(now_);
      sender.saveToDisk();
      EXPECT_EQ(sender.deliveredButThere(), 5u);
      EXPECT_EQ(log_.size(), 1u) << "told once";
    }
    sender.tryDisk(now_ += 10s);
    EXPECT_EQ(sender.deliveredButThere(), 0u) << "there is room again";
    ASSERT_TRUE(sender.add(next(7, 8)));
    EXPECT_EQ(log_.size(), 2u);
    EXPECT_EQ(sender.waitingInMemory(), 0u);
  }
  EXPECT_EQ(outboxAt(path_).size(), 1u);
}

TEST_F(OnFullDisk, ThatTheAgentEndsThereCostsNothingButASecondDelivery) {
  {
    KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
    addTo(sender, 5);
    const FullDisk full(path_ + "-wal");
    deliver(sender);
    EXPECT_EQ(sender.deliveredButThere(), 5u);
  }
  KeyframeSender sender = this->sender(8, quickly(), outboxAt(path_));
  EXPECT_EQ(sender.waitingInAll(), 5u);
  deliver(sender);
  EXPECT_EQ(wire_.held.size(), 5u);
  EXPECT_EQ(sender.deliveredButThere(), 0u);
}

TEST_F(OnFullDisk, WhatIsInMemoryGoesToTheDiskWhenThatTakesItAgain) {
  {
    wire_.there = 0;
    KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
    addTo(sender, 5);
    {
      const FullDisk full(path_ + "-wal");
      for (uint32_t i = 5; i < 9; ++i) ASSERT_TRUE(sender.add(next(7, i)));
      EXPECT_EQ(sender.waitingInMemory(), 4u);
    }
    now_ += 10s;
    sender.tryDisk(now_);
    sender.tryDisk(now_);
    EXPECT_EQ(sender.waitingInMemory(), 2u) << "one at a time";
    ASSERT_TRUE(sender.add(next(7, 9)));
    EXPECT_EQ(sender.waitingInMemory(), 3u) << "in order";
    sender.saveToDisk();
    EXPECT_EQ(sender.waitingInMemory(), 0u);
    EXPECT_EQ(sender.waiting(), 10u);
    EXPECT_EQ(log_.size(), 2u);
    EXPECT_NE(log_.back().find("can be written again"), std::string::npos);
  }
  wire_.there = 1;
  KeyframeSender sender = this->sender(8, quickly(), outboxAt(path_));
  deliver(sender);
  EXPECT_EQ(wire_.trackers.at(7).state().next_expected, 10u);
}

// The file is damaged under the agent that has it open.
class DamagedUnderway : public Sender {
 protected:
  // An earlier life leaves 40 keyframes.
  void SetUp() override {
    auto outbox = outboxAt(path_);
    for (uint32_t i = 0; i < 40; ++i) ASSERT_TRUE(outbox.add(rowOf(next(5, i)), *encodeKeyframe(next(5, i), 90)));
  }
  size_t heldOf(uint64_t session) const {
    return static_cast<size_t>(std::count_if(wire_.held.begin(), wire_.held.end(),
                                             [&](const KeyframeId& id) { return id.session == session; }));
  }
};

TEST_F(DamagedUnderway, OneKeyframeCostsThatOneAndAllElseArrives) {
  const auto tenth = *encodeKeyframe(next(5, 10), 90);
  const int64_t page = pageOf(path_, std::span(tenth).last(200).first(40));
  ASSERT_GT(page, 0);
  KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
  for (uint32_t i = 0; i < 3; ++i) ASSERT_TRUE(sender.add(next(7, i)));
  wipePage(path_, page);
  deliver(sender);
  EXPECT_EQ(heldOf(7), 3u);
  EXPECT_GE(heldOf(5), 38u) << "a page holds parts of two messages at most";
  EXPECT_FALSE(wire_.held.contains({"r", 5, 10}));
  EXPECT_EQ(wire_.trackers.at(5).state().next_expected, 40u) << "the core waits for nothing";
  ASSERT_TRUE(sender.add(next(7, 3)));
  deliver(sender);
  EXPECT_EQ(heldOf(7), 4u);
}

TEST_F(DamagedUnderway, ACutFileLosesWhatIsBehindTheCutAndNewOnesGoOn) {
  KeyframeSender sender = this->sender(7, quickly(), outboxAt(path_));
  ASSERT_TRUE(sender.add(next(7, 0)));
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) * 3 / 4);
  deliver(sender);
  EXPECT_GE(heldOf(5), 25u);
  EXPECT_LT(heldOf(5), 40u);
  for (uint32_t i = 1; i < 4; ++i) ASSERT_TRUE(sender.add(next(7, i)));
  deliver(sender);
  EXPECT_EQ(wire_.trackers.at(7).state().next_expected, 4u) << "the core waits for nothing";
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
