#include "protocol/session/outbox.h"

namespace comap {

Result<void> Outbox::add(uint32_t sequence, std::vector<uint8_t> encoded) {
  if (sequence < next_) {
    return Error{ErrorCode::kWrongUse, "outbox: sequence " + std::to_string(sequence) + " of robot '" + robot_ +
                                           "', expected " + std::to_string(next_) + " or more"};
  }
  next_ = sequence + 1;
  bytes_ += encoded.size();
  waiting_[sequence] = {std::move(encoded), std::nullopt};
  return {};
}

std::vector<uint32_t> Outbox::due(Clock::time_point now, size_t window, Clock::duration resend_after) {
  std::vector<uint32_t> sequences;
  for (auto& [sequence, entry] : waiting_) {
    const bool again = entry.sent && now - *entry.sent >= resend_after;
    const bool first = !entry.sent && under_way_ < window;
    if (!again && !first) continue;
    if (first) ++under_way_;
    entry.sent = now;
    sequences.push_back(sequence);
  }
  return sequences;
}

std::span<const uint8_t> Outbox::encoded(uint32_t sequence) const {
  const auto found = waiting_.find(sequence);
  return found == waiting_.end() ? std::span<const uint8_t>() : std::span<const uint8_t>(found->second.encoded);
}

void Outbox::notSent(uint32_t sequence) {
  const auto found = waiting_.find(sequence);
  if (found == waiting_.end() || !found->second.sent) return;
  found->second.sent.reset();
  --under_way_;
}

Outbox::Iterator Outbox::drop(Iterator entry) {
  bytes_ -= entry->second.encoded.size();
  if (entry->second.sent) --under_way_;
  return waiting_.erase(entry);
}

size_t Outbox::acknowledge(const Acknowledgement& acknowledgement) {
  const bool ours = acknowledgement.robot == robot_ && acknowledgement.session == session_;
  if (!ours || !acknowledgement.refusal.empty()) return 0;
  const size_t before = waiting_.size();
  for (auto entry = waiting_.begin(); entry != waiting_.end() && entry->first < acknowledgement.next_expected;) {
    entry = drop(entry);
  }
  for (const uint32_t sequence : acknowledgement.also_held) {
    if (const auto found = waiting_.find(sequence); found != waiting_.end()) drop(found);
  }
  return before - waiting_.size();
}

}  // namespace comap
