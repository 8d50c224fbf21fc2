#include "protocol/session/ack_tracker.h"

namespace comap {

bool AckTracker::record(uint32_t sequence) {
  if (sequence < next_expected_ || !accepts(sequence)) return false;
  if (sequence > next_expected_) return beyond_.insert(sequence).second;
  ++next_expected_;
  while (!beyond_.empty() && *beyond_.begin() == next_expected_) {
    beyond_.erase(beyond_.begin());
    ++next_expected_;
  }
  return true;
}

Acknowledgement AckTracker::state() const {
  Acknowledgement state;
  state.robot = robot_;
  state.session = session_;
  state.next_expected = next_expected_;
  const auto last = beyond_.size() > kMaxTold ? std::next(beyond_.begin(), kMaxTold) : beyond_.end();
  state.also_held.assign(beyond_.begin(), last);
  return state;
}

}  // namespace comap
