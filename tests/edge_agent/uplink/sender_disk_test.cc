// The sender on a disk that fails: full, or its outbox damaged while it runs.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "tests/edge_agent/uplink/bad_wire.h"
#include "tests/files/damaged_database.h"

namespace comap {
namespace {

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

}  // namespace
}  // namespace comap
