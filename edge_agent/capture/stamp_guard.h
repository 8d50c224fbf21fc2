// Makes the stamps of a device fit to be believed.
#pragma once

#include <cstdint>
#include <optional>

namespace comap {

/// Stamps that come out grow strictly. Thread rule: one thread.
class StampGuard {
 public:
  /// The stamp to use for a picture that arrived at `arrival_ns` (same clock): the device's own, unless it does not
  /// tell (0), tells a time after the arrival, more than 2 s before it, or before the picture before. Then it is the
  /// time of arrival less what pictures have lately taken from their stamp to their arrival, so that colour and depth
  /// still pair and the next good stamp is a later one. Nothing if the stamp is that of the picture before: it is that
  /// picture again.
  std::optional<int64_t> accept(int64_t stamp_ns, uint64_t sequence, int64_t arrival_ns);

  uint64_t repeated() const { return repeated_; }
  uint64_t jumps() const { return jumps_; }
  /// Sequence numbers left out so far.
  uint64_t missed() const { return missed_; }

 private:
  bool first_ = true;
  int64_t device_ns_ = 0, last_ns_ = 0;
  int64_t latency_ns_ = 0;  // the longest of late
  uint64_t sequence_ = 0, repeated_ = 0, jumps_ = 0, missed_ = 0;
};

}  // namespace comap
