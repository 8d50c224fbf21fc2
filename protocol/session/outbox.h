// The robot's encoded keyframes of one session, each kept until the core has said that it is durable there.
// Time is passed in; in memory; one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

class Outbox {
 public:
  using Clock = std::chrono::steady_clock;

  /// Only acknowledgements for this robot and session count.
  Outbox(std::string robot, uint64_t session) : robot_(std::move(robot)), session_(session) {}

  /// Takes the keyframe `sequence` to be sent. kWrongUse if that was added before.
  Result<void> add(uint32_t sequence, std::vector<uint8_t> encoded);

  /// Which to send now, lowest first: those sent longer than `resend_after` ago, and new ones while fewer than
  /// `window` are under way. Counts them as sent at `now`.
  std::vector<uint32_t> due(Clock::time_point now, size_t window, Clock::duration resend_after);

  /// The bytes of a keyframe still held; empty if there is none.
  std::span<const uint8_t> encoded(uint32_t sequence) const;

  /// The link did not take it: due again at once.
  void notSent(uint32_t sequence);

  /// Drops what the core holds. Returns how many that were; 0 for another robot, another session or a refusal.
  size_t acknowledge(const Acknowledgement& acknowledgement);

  size_t size() const { return waiting_.size(); }
  size_t bytes() const { return bytes_; }
  bool empty() const { return waiting_.empty(); }
  /// Sent and not acknowledged.
  size_t underWay() const { return under_way_; }

 private:
  struct Waiting {
    std::vector<uint8_t> encoded;
    std::optional<Clock::time_point> sent;
  };
  using Iterator = std::map<uint32_t, Waiting>::iterator;
  Iterator drop(Iterator entry);

  const std::string robot_;
  const uint64_t session_;
  std::map<uint32_t, Waiting> waiting_;
  uint32_t next_ = 0;  // every sequence added so far is below
  size_t bytes_ = 0, under_way_ = 0;
};

}  // namespace comap
