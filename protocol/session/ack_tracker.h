// What the core holds of one robot's session, as the acknowledgement tells it. One thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>

#include "protocol/types/messages.h"

namespace comap {

class AckTracker {
 public:
  /// How far beyond the first gap a sequence may lie: bounds memory and message against a hostile robot.
  static constexpr uint32_t kMaxAhead = 60000;
  /// Sequences held beyond the first gap that are told: the message has to fit one datagram. They are those that came
  /// last, also if they came again, so that each is told whose robot does not know yet, however long the gap stays.
  static constexpr size_t kMaxTold = 100;

  AckTracker(std::string robot, uint64_t session) : robot_(std::move(robot)), session_(session) {}

  /// Whether `sequence` may be recorded: it is not more than kMaxAhead beyond the first gap.
  bool accepts(uint32_t sequence) const { return sequence < next_expected_ || sequence - next_expected_ <= kMaxAhead; }

  /// Call whenever the keyframe has come, once it is durable. True if it was new and acceptable.
  bool record(uint32_t sequence);

  /// Without mapped_below and refusal, which are not its business.
  Acknowledgement state() const;

 private:
  const std::string robot_;
  const uint64_t session_;
  uint32_t next_expected_ = 0;
  std::set<uint32_t> beyond_;    // held, all above next_expected_
  std::deque<uint32_t> newest_;  // of those, as they came
};

}  // namespace comap
