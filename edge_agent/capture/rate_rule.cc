#include "edge_agent/capture/rate_rule.h"

namespace comap {
namespace {

constexpr int kMost = 8, kSettle = 8, kCalm = 30;
constexpr double kTooMuch = 0.9, kRoom = 0.7, kShare = 1.0 / 8;

}  // namespace

void RateRule::worked(int64_t work_ns, int64_t period_ns) {
  if (period_ns <= 0) return;
  period_ns_ = period_ns;
  const double work = static_cast<double>(work_ns), period = static_cast<double>(period_ns);
  work_ns_ = frames_ == 0 ? work : work_ns_ + kShare * (work - work_ns_);
  ++frames_;
  calm_ = every_ > 1 && work_ns_ < kRoom * (every_ - 1) * period ? calm_ + 1 : 0;
  if (frames_ >= kSettle && work_ns_ > kTooMuch * every_ * period && every_ < kMost) {
    ++every_;
    frames_ = 1;  // the average goes on, and has to settle before the next step
    calm_ = 0;
  } else if (calm_ >= kCalm) {
    --every_;
    frames_ = 1;
    calm_ = 0;
  }
}

bool RateRule::due(int64_t stamp_ns, int64_t last_ns) const {
  if (every() == 1) return true;
  return static_cast<double>(stamp_ns - last_ns) > (every() - 0.5) * static_cast<double>(period_ns_);
}

}  // namespace comap
