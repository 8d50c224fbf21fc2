// Keyframes that reach the core and that it cannot take, as those that an agent of another release has left in the
// outbox. They stay there, and are tried again, but seldom.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "edge_agent/uplink/outbox.h"

namespace comap {

/// Time is passed in. Thread rule: one thread.
class RefusedKeyframes {
 public:
  using Clock = std::chrono::steady_clock;

  /// It is under way as `message`: the core names what it refuses by its checksum, as it may not be able to read it.
  void sent(const OutboxKey& key, std::span<const uint8_t> message);
  /// Which keyframe the core refuses; nothing if none such is under way.
  std::optional<OutboxKey> refuse(uint32_t checksum, const std::string& reason, Clock::time_point now);
  /// The core holds it, or it is no longer in the outbox.
  void forget(const OutboxKey& key);

  /// One whose time has come: a minute after the first refusal, then twice as long each time, an hour at most.
  std::optional<OutboxKey> due(Clock::time_point now) const;
  /// Another core is there: all are due.
  void tryAgain();

  /// Up to `most` of those that this core has refused, other ones each time until all were told.
  std::vector<OutboxKey> nextToTell(size_t most);

  size_t size() const { return refused_.size(); }
  /// Of the last one; empty if none is refused now.
  const std::string& reason() const { return reason_; }

 private:
  struct Refusal {
    Clock::time_point due{};
    Clock::duration wait{};
  };
  std::map<OutboxKey, uint32_t> under_way_;  // with the checksum of what was sent
  std::map<OutboxKey, Refusal> refused_;
  OutboxKey told_;  // last
  std::string reason_;
};

}  // namespace comap
