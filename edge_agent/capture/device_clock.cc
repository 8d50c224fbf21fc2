#include "edge_agent/capture/device_clock.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>

namespace comap {
namespace {

constexpr int64_t kJump_ns = 1'000'000'000, kDriftParts = 10'000;

}  // namespace

int64_t monotonicNow_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

int64_t DeviceClock::toHost(int64_t device_ns, int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  const int64_t offset_ns = arrival_ns - device_ns;
  if (!known_ || std::abs(offset_ns - offset_ns_) > kJump_ns) {
    known_ = true;
    offset_ns_ = offset_ns;
  } else {
    const int64_t drifted_ns = offset_ns_ + std::max<int64_t>(arrival_ns - last_arrival_ns_, 0) / kDriftParts;
    offset_ns_ = std::min(offset_ns, drifted_ns);
  }
  last_arrival_ns_ = arrival_ns;
  return device_ns + offset_ns_;
}

}  // namespace comap
