// A sender, and a core at the other end of a wire that loses, doubles, reorders and goes away.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "edge_agent/uplink/keyframe_sender.h"
#include "protocol/session/ack_tracker.h"
#include "tests/edge_agent/uplink/keyframes.h"

namespace comap {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A core at the other end of a bad wire.
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

  /// Some of what is on the way arrives, in any order; the answers, too.
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

inline SenderOptions quickly() {
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

}  // namespace comap
