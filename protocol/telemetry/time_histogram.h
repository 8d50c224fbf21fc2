// Quantiles of durations in constant memory, however many there are.
#pragma once

#include <array>
#include <cstdint>

namespace comap {

/// Counts in bins that each are 2 % wider than the one before: a quantile is right to 1 %. Thread rule: one thread.
class TimeHistogram {
 public:
  /// Durations below 10 us count as 10 us, those above 100 s as 100 s; the largest is kept exactly.
  void add(double milliseconds);

  uint64_t count() const { return count_; }
  /// The duration, in milliseconds, that the share `q` (0..1) of all is below; 0 if there are none.
  double quantile_ms(double q) const;
  double worst_ms() const { return worst_ms_; }
  double sum_ms() const { return sum_ms_; }

 private:
  static constexpr int kBins = 815;  // of 2 % from 10 us to 100 s
  std::array<uint64_t, kBins> bins_{};
  uint64_t count_ = 0;
  double worst_ms_ = 0, sum_ms_ = 0;
};

}  // namespace comap
