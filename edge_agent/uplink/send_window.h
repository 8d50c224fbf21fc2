// Which keyframes are under way, how many may be, and when one is sent again. Time is passed in.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "edge_agent/uplink/outbox.h"
#include "protocol/session/delivery_rate.h"

namespace comap {

struct SendOptions {
  size_t window = 8;  ///< keyframes under way at most
  std::chrono::milliseconds resend_after{3000};
  /// Mean rate; 0: as fast as the link takes them.
  uint64_t budget_bytes_per_s = 4'000'000;
  /// Not to have more under way than the link delivers in a second, as measured.
  bool paced = true;
};

/// The window opens from 2 keyframes, by one for each acknowledged, to options.window; it is halved when keyframes are
/// overdue. On a slow link it holds what arrives within a second, and a keyframe at least: what is sent beyond that
/// waits in queues on the way, where it is lost first. Overdue: not acknowledged after resend_after, or thrice the
/// usual time if that is longer; each further time after twice as long, a minute at most. So a slow link is not filled
/// with repeats. Thread rule: one thread.
class SendWindow {
 public:
  using Clock = std::chrono::steady_clock;
  explicit SendWindow(const SendOptions& options) : options_(options) {}

  /// Whether another keyframe may be sent now.
  bool hasRoom(Clock::time_point now) const;
  bool contains(const OutboxKey& key) const { return under_way_.contains(key); }
  /// Those to be sent again, oldest first; halves the window if there are any.
  std::vector<OutboxKey> overdue(Clock::time_point now);

  /// The link has taken it, for the first time or again.
  void sent(const OutboxKey& key, size_t bytes, Clock::time_point now);
  void acknowledged(std::span<const OutboxKey> keys, Clock::time_point now);
  /// It is no longer there to be sent.
  void forget(const OutboxKey& key);
  /// The peer is another one than before: what is under way may be lost with the old one, and is overdue now.
  void restart();

  size_t underWay() const { return under_way_.size(); }
  const DeliveryRate& rate() const { return rate_; }

 private:
  struct Sent {
    DeliveryRate::Mark first;
    Clock::time_point last;
    size_t bytes = 0;
    int times = 0;  // 0: overdue at once
  };
  Clock::duration patience(const Sent& sent) const;
  double budgetAt(Clock::time_point now) const;

  const SendOptions options_;
  std::map<OutboxKey, Sent> under_way_;
  size_t under_way_bytes_ = 0, last_bytes_ = 0;
  DeliveryRate rate_;
  double open_ = 2;               // the window, between 1 and options.window
  double usual_s_ = 0;            // smoothed time from sending to acknowledgement; 0: none known
  double credit_bytes_ = 0;       // of the budget, at credited_; may be negative after a large message
  Clock::time_point credited_{};  // never: a full second's
};

}  // namespace comap
