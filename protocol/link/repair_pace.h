// How often lost datagrams are asked for again: as often as the way there and back allows, and no oftener.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace comap {

/// DDS tells a reader every period what it should have, and sends again all that the reader then lacks. On a link
/// whose queues hold a second of data, a period of a tenth of that sends everything ten times, which fills the queues
/// for good. So the period follows the time that small messages take to be confirmed: long if there are queues, short
/// if there is only loss. Time is passed in. Thread rule: one thread.
class RepairPace {
 public:
  using Duration = std::chrono::milliseconds;
  static constexpr Duration kShortest{100}, kFirst{300}, kLongest{3000};

  /// A small message was confirmed `took` after it was sent.
  void confirmed(Duration took);
  /// One has been waiting for this long.
  void waiting(Duration since);

  /// The period that writers should have now; it changes by half at least.
  Duration period() const { return period_; }

 private:
  static constexpr size_t kRemembered = 4;
  void follow(Duration round_trip);

  std::array<Duration, kRemembered> last_{};
  size_t count_ = 0;
  Duration period_ = kFirst;
};

}  // namespace comap
