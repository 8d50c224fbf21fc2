#include "protocol/telemetry/time_histogram.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

constexpr double kSmallest_ms = 0.01, kGrowth = 1.02;

}  // namespace

void TimeHistogram::add(double milliseconds) {
  const double steps = std::log(std::max(milliseconds, kSmallest_ms) / kSmallest_ms) / std::log(kGrowth);
  ++bins_[static_cast<size_t>(std::min<double>(steps, kBins - 1))];
  ++count_;
  worst_ms_ = std::max(worst_ms_, milliseconds);
  sum_ms_ += milliseconds;
}

double TimeHistogram::quantile_ms(double q) const {
  if (count_ == 0) return 0;
  const auto rank = std::min(count_ - 1, static_cast<uint64_t>(q * static_cast<double>(count_)));
  uint64_t below = 0;
  for (size_t i = 0; i < bins_.size(); ++i) {
    below += bins_[i];
    if (below > rank) return std::min(worst_ms_, kSmallest_ms * std::pow(kGrowth, static_cast<double>(i) + 0.5));
  }
  return worst_ms_;
}

}  // namespace comap
