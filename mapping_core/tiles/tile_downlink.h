// What is on its way to one robot: which tiles, and how much more may be.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <span>
#include <vector>

#include "protocol/session/delivery_rate.h"
#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// A robot reports with each interest what it holds. What was sent and is not reported yet counts as held until it is
/// overdue. More is under way only as fast as it arrives, so that a slow link carries corrections and acknowledgements
/// too; and in no second is more sent than the robot allows. Time is passed in. Thread rule: one thread.
class TileDownlink {
 public:
  using Clock = std::chrono::steady_clock;

  /// The robot is in `map` and holds `held` of it. Returns what it holds or is about to.
  std::vector<HeldTile> reported(const MapId& map, std::span<const HeldTile> held, Clock::time_point now);
  /// `removal`: the robot is told that there is no such tile.
  void sent(const TileKey& key, uint64_t revision, size_t bytes, Clock::time_point now, bool removal = false);

  /// What the last report and what was sent since say that it holds or is about to; not what it names because it knows
  /// that it is gone. By key.
  std::vector<HeldTile> held() const;
  /// Whether the last report, on this map, is so fresh that more may be sent without waiting for the next one.
  bool fresh(const MapId& map, Clock::time_point now) const;

  /// How many bytes may be sent now beside those under way.
  size_t room() const;
  /// How many bytes may be sent now so that within any second no more than `bytes_per_s` have been: a message's own
  /// envelope is counted as kEnvelope. All of them if nothing was sent for a second, so that a tile larger than that
  /// comes through alone.
  size_t allowance(size_t bytes_per_s, Clock::time_point now);
  static constexpr size_t kEnvelope = 300;  ///< of DDS, encrypted, in datagrams
  size_t underWayBytes() const { return under_way_bytes_; }

 private:
  struct Sent {
    uint64_t revision = 0;
    uint32_t report = 0;  // number of the report that it answered
    size_t bytes = 0;
    DeliveryRate::Mark mark;
  };
  void forget(std::map<TileKey, Sent>::iterator it);

  MapId map_;
  std::map<TileKey, uint64_t> reported_;  // of map_
  std::deque<std::pair<Clock::time_point, size_t>> last_second_;
  size_t last_second_bytes_ = 0;
  uint32_t reports_ = 0;
  Clock::time_point last_report_{};
  double between_reports_s_ = 0;
  std::map<TileKey, Sent> under_way_;
  size_t under_way_bytes_ = 0;
  std::map<TileKey, uint64_t> removed_;  // revisions under which tiles were told to be gone
  DeliveryRate rate_;
};

}  // namespace comap
