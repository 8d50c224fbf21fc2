#include "edge_agent/uplink/send_window.h"

#include <algorithm>

namespace comap {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kSmoothing = 0.25;
constexpr double kUsualTimes = 3;
constexpr Seconds kMostPatience{60};
constexpr int kMostDoublings = 5;
constexpr double kQueue_s = 1;

}  // namespace

double SendWindow::budgetAt(Clock::time_point now) const {
  const auto rate = static_cast<double>(options_.budget_bytes_per_s);
  if (credited_ == Clock::time_point()) return rate;
  return std::min(rate, credit_bytes_ + rate * Seconds(now - credited_).count());
}

bool SendWindow::hasRoom(Clock::time_point now) const {
  if (under_way_.size() >= std::max<size_t>(1, static_cast<size_t>(open_))) return false;
  if (options_.paced && !under_way_.empty() && rate_.bytesPerSecond() > 0 &&
      under_way_bytes_ + last_bytes_ > rate_.bytesWithin(kQueue_s, 0))
    return false;
  return options_.budget_bytes_per_s == 0 || budgetAt(now) > 0;
}

SendWindow::Clock::duration SendWindow::patience(const Sent& sent) const {
  if (sent.times == 0) return Clock::duration::zero();
  const Seconds once = std::max<Seconds>(options_.resend_after, Seconds(kUsualTimes * usual_s_));
  const Seconds now = once * (1 << std::min(sent.times - 1, kMostDoublings));
  return std::chrono::duration_cast<Clock::duration>(std::min(now, std::max(kMostPatience, once)));
}

std::vector<OutboxKey> SendWindow::overdue(Clock::time_point now) {
  std::vector<OutboxKey> keys;
  bool lost = false;
  for (auto& [key, sent] : under_way_) {
    if (now - sent.last < patience(sent)) continue;
    lost |= sent.times > 0;
    keys.push_back(key);
  }
  if (lost) open_ = std::max(1.0, open_ / 2);
  if (options_.budget_bytes_per_s > 0 && budgetAt(now) <= 0) return {};
  return keys;
}

void SendWindow::sent(const OutboxKey& key, size_t bytes, Clock::time_point now) {
  Sent& sent = under_way_[key];
  if (sent.times++ == 0 && sent.bytes == 0) {
    sent.first = rate_.mark(now);
    sent.bytes = bytes;
    under_way_bytes_ += bytes;
  }
  sent.last = now;
  last_bytes_ = bytes;
  if (options_.budget_bytes_per_s == 0) return;
  credit_bytes_ = budgetAt(now) - static_cast<double>(bytes);
  credited_ = now;
}

void SendWindow::acknowledged(std::span<const OutboxKey> keys, Clock::time_point now) {
  for (const OutboxKey& key : keys) {
    const auto found = under_way_.find(key);
    if (found == under_way_.end()) continue;
    const Sent& sent = found->second;
    if (sent.times == 1) {
      const double took_s = Seconds(now - sent.first.sent).count();
      usual_s_ = usual_s_ == 0 ? took_s : usual_s_ + kSmoothing * (took_s - usual_s_);
      rate_.delivered(sent.first, sent.bytes, now);
    } else {
      rate_.deliveredSometime(sent.bytes);
    }
    forget(key);
    open_ = std::min(open_ + 1, static_cast<double>(options_.window));
  }
}

void SendWindow::forget(const OutboxKey& key) {
  const auto found = under_way_.find(key);
  if (found == under_way_.end()) return;
  under_way_bytes_ -= found->second.bytes;
  under_way_.erase(found);
}

void SendWindow::restart() {
  for (auto& [key, sent] : under_way_) sent.times = 0;
}

}  // namespace comap
