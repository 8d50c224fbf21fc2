#include "protocol/session/delivery_rate.h"

#include <algorithm>

namespace comap {
namespace {

constexpr std::chrono::seconds kWhile{10};
constexpr double kShortest_s = 1e-3;  // clocks and threads are no finer

}  // namespace

void DeliveryRate::delivered(const Mark& mark, size_t bytes, Clock::time_point now) {
  delivered_bytes_ += bytes;
  const double took_s = std::max(kShortest_s, std::chrono::duration<double>(now - mark.sent).count());
  const double rate = static_cast<double>(delivered_bytes_ - mark.delivered_bytes) / took_s;
  while (!best_.empty() && best_.back().bytes_per_s <= rate) best_.pop_back();
  best_.push_back({now, rate});
  while (best_.size() > 1 && now - best_.front().at > kWhile) best_.pop_front();
}

double DeliveryRate::bytesPerSecond() const { return best_.empty() ? 0 : best_.front().bytes_per_s; }

size_t DeliveryRate::bytesWithin(double seconds, size_t at_least) const {
  return std::max(at_least, static_cast<size_t>(bytesPerSecond() * seconds));
}

}  // namespace comap
