#include "protocol/link/repair_pace.h"

#include <algorithm>

namespace comap {
namespace {

constexpr double kRoundTrips = 1.5;
constexpr double kWorthwhile = 1.5;

}  // namespace

void RepairPace::confirmed(Duration took) {
  last_[count_++ % kRemembered] = took;
  // Not the mean: one that was lost on the way took as long as its repair.
  auto sorted = last_;
  const size_t known = std::min(count_, kRemembered);
  std::sort(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(known));
  follow(sorted[std::min<size_t>(1, known - 1)]);
}

void RepairPace::waiting(Duration since) {
  if (since > 2 * period_) follow(since);
}

void RepairPace::follow(Duration round_trip) {
  const auto wanted = std::clamp(std::chrono::duration_cast<Duration>(kRoundTrips * round_trip), kShortest, kLongest);
  const bool far = wanted > kWorthwhile * period_ || period_ > kWorthwhile * wanted;
  if (far || wanted == kShortest || wanted == kLongest) period_ = wanted;
}

}  // namespace comap
