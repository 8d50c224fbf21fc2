// Whether a core keeps up with its robots.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

namespace comap {

/// Thread rule: one thread.
class CoreLoad {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kWindow{60};

  /// Over the last minute.
  struct Figure {
    double arriving_per_s = 0;  ///< keyframes
    double keyframe_s = 0;      ///< that mapping one took, on average
    /// Share of the core's time that what arrives needs; above 1 it falls behind.
    double load() const { return arriving_per_s * keyframe_s; }
  };

  void arrived(Clock::time_point now);
  void mapped(Clock::time_point now, Clock::duration took);
  Figure figure(Clock::time_point now) const;

  /// What to do, if the core has fallen behind by more than half a minute's work and the load stays above 1; at most
  /// once in ten minutes. `waiting`: keyframes that are not mapped yet.
  std::optional<std::string> advise(Clock::time_point now, size_t waiting);

 private:
  struct Mapped {
    Clock::time_point at;
    Clock::duration took;
  };
  void forget(Clock::time_point now);
  std::optional<Clock::time_point> since_;
  std::deque<Clock::time_point> arrivals_;
  std::deque<Mapped> mapped_;
  std::optional<Clock::time_point> advised_;
};

}  // namespace comap
