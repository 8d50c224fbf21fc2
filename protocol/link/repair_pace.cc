#include "protocol/link/repair_pace.h"

#include <algorithm>

namespace comap {

void RepairPace::confirmed(Duration took) {
  last_[count_++ % kRemembered] = took;
  // Not the mean: one that was lost on the way took as long as its repair.
  auto sorted = last_;
  const size_t known = std::min(count_, kRemembered);
  std::sort(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(known));
  follow(sorted[std::min<size_t>(1, known - 1)]);
}

void RepairPace::waiting(Duration since) {
  if (since > 2 * kPeriods[choice_]) follow(since);
}

void RepairPace::follow(Duration round_trip) {
  while (choice_ + 1 < kPeriods.size() && round_trip > kPeriods[choice_]) ++choice_;
  // Back only when it is clear: what the slower one has under way is asked for by that one's period still.
  while (choice_ > 0 && round_trip <= 3 * kPeriods[choice_ - 1] / 4) --choice_;
}

}  // namespace comap
