// What a camera's rate has to do with how hot the machine is.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace comap {

/// The highest temperature in degrees Celsius that the kernel tells in `folder`/thermal_zone*/temp (thousandths of
/// degrees; /sys/class/thermal); nothing if there is none. Zones that cannot be read, or tell what no machine survives
/// (outside -50 to 200), are passed over.
std::optional<double> hottest_C(const std::string& folder);

/// The rule: at `hot_C` or above, one frame less is taken (of `every`, one), and again each 10 s for as long as that
/// lasts, up to one of 8; after 30 s at 5 degrees or more below, one step back. In between, and while no temperature
/// is known, nothing changes. `hot_C` of 0: always one of one.
/// Thread rule: one thread.
class HeatRule {
 public:
  using Clock = std::chrono::steady_clock;

  explicit HeatRule(double hot_C) : hot_C_(hot_C) {}

  /// The temperature at `now`, which must not go back.
  void measured(std::optional<double> hottest_C, Clock::time_point now);

  int every() const { return every_; }

 private:
  double hot_C_;
  int every_ = 1;
  std::optional<Clock::time_point> stepped_;  // when a frame less was last taken
  std::optional<Clock::time_point> cool_since_;
};

}  // namespace comap
