// How fast messages arrive at the other end, from when they were sent and when they were confirmed.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace comap {

/// The rate at which a link delivers, as far as it was used: of each confirmed message, what was confirmed between its
/// sending and its confirmation, divided by that time. The best of the last while counts, since a sender that has
/// little to say does not show what the link can do. Time is passed in. Thread rule: one thread.
class DeliveryRate {
 public:
  using Clock = std::chrono::steady_clock;
  /// What is to be remembered of a message from its sending on.
  struct Mark {
    Clock::time_point sent;
    uint64_t delivered_bytes = 0;  ///< in all, when it was sent
  };

  Mark mark(Clock::time_point now) const { return {now, delivered_bytes_}; }
  /// A message of so many bytes is confirmed.
  void delivered(const Mark& mark, size_t bytes, Clock::time_point now);
  /// The same of one that was sent more than once: when is not known.
  void deliveredSometime(size_t bytes) { delivered_bytes_ += bytes; }

  /// 0: nothing is known yet.
  double bytesPerSecond() const;
  /// What may be under way so that it takes no longer than `seconds` to arrive: more only makes a queue somewhere.
  /// `at_least` if less, or if nothing is known.
  size_t bytesWithin(double seconds, size_t at_least) const;

 private:
  struct Sample {
    Clock::time_point at;
    double bytes_per_s;
  };
  uint64_t delivered_bytes_ = 0;
  std::deque<Sample> best_;  // falling rates at rising times: the first is the best of the last while
};

}  // namespace comap
