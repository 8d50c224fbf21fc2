#include "edge_agent/capture/stamp_guard.h"

#include <algorithm>

namespace comap {
namespace {

constexpr int64_t kLate_ns = 2'000'000'000, kEarly_ns = 5'000'000;
constexpr uint64_t kRestarted = 1000;  // a larger gap is a new count, not so many pictures lost

}  // namespace

std::optional<int64_t> StampGuard::accept(int64_t stamp_ns, uint64_t sequence, int64_t arrival_ns) {
  if (!first_ && stamp_ns != 0 && stamp_ns == device_ns_) {
    ++repeated_;
    return std::nullopt;
  }
  if (!first_ && sequence > sequence_ + 1 && sequence - sequence_ < kRestarted) missed_ += sequence - sequence_ - 1;
  const bool told = stamp_ns != 0;
  const bool believed = told && stamp_ns <= arrival_ns + kEarly_ns && stamp_ns >= arrival_ns - kLate_ns &&
                        (first_ || stamp_ns > last_ns_);
  jumps_ += told && !believed;
  device_ns_ = stamp_ns;
  sequence_ = sequence;
  if (believed) latency_ns_ = std::max(arrival_ns - stamp_ns, latency_ns_ - latency_ns_ / 16);
  const int64_t guessed_ns = arrival_ns - latency_ns_;
  last_ns_ = believed ? stamp_ns : first_ ? guessed_ns : std::max(guessed_ns, last_ns_ + 1);
  first_ = false;
  return last_ns_;
}

}  // namespace comap
