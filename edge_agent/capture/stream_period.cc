#include "edge_agent/capture/stream_period.h"

#include <algorithm>

namespace comap {
namespace {

constexpr int64_t kGrowthParts = 50;

}  // namespace

void StreamPeriod::add(int64_t stamp_ns) {
  if (last_ns_ && stamp_ns > *last_ns_) {
    const int64_t gap_ns = stamp_ns - *last_ns_;
    period_ns_ = period_ns_ == 0 ? gap_ns : std::min(gap_ns, period_ns_ + period_ns_ / kGrowthParts);
  }
  last_ns_ = stamp_ns;
}

}  // namespace comap
