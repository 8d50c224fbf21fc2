#include "protocol/session/ack_tracker.h"

#include <algorithm>

namespace comap {

bool AckTracker::record(uint32_t sequence) {
  if (sequence < next_expected_ || !accepts(sequence)) return false;
  if (sequence > next_expected_) {
    std::erase(newest_, sequence);
    newest_.push_back(sequence);
    if (newest_.size() > kMaxTold) newest_.pop_front();
    return beyond_.insert(sequence).second;
  }
  ++next_expected_;
  while (!beyond_.empty() && *beyond_.begin() == next_expected_) {
    beyond_.erase(beyond_.begin());
    ++next_expected_;
  }
  std::erase_if(newest_, [this](uint32_t told) { return told < next_expected_; });
  return true;
}

Acknowledgement AckTracker::state() const {
  Acknowledgement state;
  state.robot = robot_;
  state.session = session_;
  state.next_expected = next_expected_;
  state.also_held.assign(newest_.begin(), newest_.end());
  std::sort(state.also_held.begin(), state.also_held.end());
  return state;
}

}  // namespace comap
