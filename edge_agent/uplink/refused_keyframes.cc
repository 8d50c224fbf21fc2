#include "edge_agent/uplink/refused_keyframes.h"

#include <algorithm>

#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

constexpr std::chrono::seconds kFirstWait{60}, kLongestWait{3600};

}  // namespace

void RefusedKeyframes::sent(const OutboxKey& key, std::span<const uint8_t> message) {
  under_way_[key] = messageChecksum(message);
  if (const auto found = refused_.find(key); found != refused_.end()) found->second.due = Clock::time_point::max();
}

std::optional<OutboxKey> RefusedKeyframes::refuse(uint32_t checksum, const std::string& reason, Clock::time_point now) {
  const auto found =
      std::find_if(under_way_.begin(), under_way_.end(), [&](const auto& entry) { return entry.second == checksum; });
  if (found == under_way_.end()) return std::nullopt;
  const OutboxKey key = found->first;
  under_way_.erase(found);
  Refusal& refusal = refused_[key];
  refusal.wait = std::clamp<Clock::duration>(2 * refusal.wait, kFirstWait, kLongestWait);
  refusal.due = now + refusal.wait;
  reason_ = reason;
  return key;
}

void RefusedKeyframes::forget(const OutboxKey& key) {
  under_way_.erase(key);
  refused_.erase(key);
  if (refused_.empty()) reason_.clear();
}

std::optional<OutboxKey> RefusedKeyframes::due(Clock::time_point now) const {
  for (const auto& [key, refusal] : refused_)
    if (refusal.due <= now) return key;
  return std::nullopt;
}

std::vector<OutboxKey> RefusedKeyframes::nextToTell(size_t most) {
  std::vector<OutboxKey> keys;
  auto next = refused_.upper_bound(told_);
  for (size_t looked_at = 0; looked_at < refused_.size() && keys.size() < most; ++looked_at, ++next) {
    if (next == refused_.end()) next = refused_.begin();
    if (next->second.wait == Clock::duration()) continue;  // by another core
    keys.push_back(next->first);
    told_ = next->first;
  }
  return keys;
}

void RefusedKeyframes::tryAgain() {
  for (auto& [key, refusal] : refused_) refusal = {};
}

}  // namespace comap
