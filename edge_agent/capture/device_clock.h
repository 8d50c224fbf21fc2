// The host's clock, and a device's own seen from it.
#pragma once

#include <cstdint>
#include <mutex>

namespace comap {

/// The host's monotonic clock, which devices stamp their pictures with.
int64_t monotonicNow_ns();

/// Learns the difference from arrivals: the smallest delay seen counts as none, and may grow by 100 ppm, as clocks
/// drift. Any thread.
class DeviceClock {
 public:
  /// The host's time of a device's stamp that arrived at `arrival_ns`. A jump of more than a second begins anew.
  int64_t toHost(int64_t device_ns, int64_t arrival_ns);

 private:
  std::mutex mutex_;
  bool known_ = false;
  int64_t offset_ns_ = 0, last_arrival_ns_ = 0;
};

}  // namespace comap
