#include "mapping_core/tiles/tile_downlink.h"

#include <algorithm>

namespace comap {
namespace {

constexpr uint32_t kOverdueReports = 6;  // a tile not reported as held by then was lost on the way
constexpr std::chrono::seconds kOverdue{5};
constexpr std::chrono::seconds kFresh{3};  // a robot reports twice a second
constexpr double kQueue_s = 1;
constexpr size_t kAtLeastBytes = 64 << 10;
constexpr double kLongestBetween_s = 5, kSmoothing = 0.25;

}  // namespace

std::vector<HeldTile> TileDownlink::reported(const MapId& map, std::span<const HeldTile> held, Clock::time_point now) {
  if (map != map_) {
    map_ = map;
    under_way_.clear();
    under_way_bytes_ = 0;
    removed_.clear();
  }
  if (reports_++ > 0) {
    const double since_s = std::min(kLongestBetween_s, std::chrono::duration<double>(now - last_report_).count());
    between_reports_s_ += (reports_ == 2 ? 1 : kSmoothing) * (since_s - between_reports_s_);
  }
  last_report_ = now;

  std::map<TileKey, uint64_t>& known = reported_;
  known.clear();
  for (const HeldTile& tile : held)
    if (tile.key.map == map) known[tile.key] = tile.revision;
  for (auto it = under_way_.begin(); it != under_way_.end();) {
    const auto current = it++;
    const auto& [key, sent] = *current;
    const auto of_robot = known.find(key);
    if (of_robot != known.end() && of_robot->second == sent.revision) {
      rate_.delivered(sent.mark, sent.bytes, now);
      forget(current);
    } else if (reports_ - sent.report >= kOverdueReports && now - sent.mark.sent >= kOverdue) {
      forget(current);
    }
  }
  std::erase_if(removed_,
                [&](const auto& told) { return !known.contains(told.first) && !under_way_.contains(told.first); });
  return this->held();
}

std::vector<HeldTile> TileDownlink::held() const {
  std::vector<HeldTile> all;
  all.reserve(reported_.size() + under_way_.size());
  const auto add = [&](const TileKey& key, uint64_t revision) {
    const auto removed = removed_.find(key);
    if (removed == removed_.end() || removed->second != revision) all.push_back({key, revision});
  };
  auto sent = under_way_.begin();
  for (const auto& [key, revision] : reported_) {
    for (; sent != under_way_.end() && sent->first < key; ++sent) add(sent->first, sent->second.revision);
    const bool newer = sent != under_way_.end() && sent->first == key;
    add(key, newer ? sent->second.revision : revision);
    if (newer) ++sent;
  }
  for (; sent != under_way_.end(); ++sent) add(sent->first, sent->second.revision);
  return all;
}

bool TileDownlink::fresh(const MapId& map, Clock::time_point now) const {
  return map == map_ && reports_ > 0 && now - last_report_ < kFresh;
}

size_t TileDownlink::allowance(size_t bytes_per_s, Clock::time_point now) {
  while (!last_second_.empty() && now - last_second_.front().first >= std::chrono::seconds(1)) {
    last_second_bytes_ -= last_second_.front().second;
    last_second_.pop_front();
  }
  return bytes_per_s > last_second_bytes_ ? bytes_per_s - last_second_bytes_ : 0;
}

void TileDownlink::sent(const TileKey& key, uint64_t revision, size_t bytes, Clock::time_point now, bool removal) {
  const auto earlier = under_way_.find(key);
  if (earlier != under_way_.end()) forget(earlier);
  under_way_[key] = {revision, reports_, bytes, rate_.mark(now)};
  under_way_bytes_ += bytes;
  if (removal)
    removed_[key] = revision;
  else
    removed_.erase(key);
  last_second_.emplace_back(now, bytes + kEnvelope);
  last_second_bytes_ += bytes + kEnvelope;
}

size_t TileDownlink::room() const {
  // A report tells of arrivals only as often as it comes: what arrives meanwhile must not have to wait for it.
  const size_t allowed = rate_.bytesWithin(kQueue_s + 2 * between_reports_s_, kAtLeastBytes);
  return allowed > under_way_bytes_ ? allowed - under_way_bytes_ : 0;
}

void TileDownlink::forget(std::map<TileKey, Sent>::iterator it) {
  under_way_bytes_ -= it->second.bytes;
  under_way_.erase(it);
}

}  // namespace comap
