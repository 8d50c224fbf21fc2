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
  /// The periods to choose from. DDS cannot change a writer's, so there is a writer for each.
  static constexpr std::array<Duration, 3> kPeriods{Duration(100), Duration(500), Duration(2500)};

  /// A small message was confirmed `took` after it was sent.
  void confirmed(Duration took);
  /// One has been waiting for this long.
  void waiting(Duration since);

  /// Which of kPeriods fits now.
  size_t choice() const { return choice_; }

 private:
  static constexpr size_t kRemembered = 4;
  void follow(Duration round_trip);

  std::array<Duration, kRemembered> last_{};
  size_t count_ = 0;
  size_t choice_ = 1;
};

}  // namespace comap
