// What can be heard of a site as an observer: robots, their places, the core, merges and verdicts.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "protocol/link/link.h"
#include "protocol/types/messages.h"

namespace comap {

using WatchClock = std::chrono::steady_clock;

struct HeardRobot {
  Status status;
  bool has_status = false;
  std::optional<Correction> correction;  ///< the last; maybe of an earlier session than the status
  WatchClock::time_point heard{};        ///< its last status or hello
  /// Keyframes that the core has taken, by time: for the rate. At most some seconds of them.
  std::deque<std::pair<WatchClock::time_point, int64_t>> delivered;

  /// Where its camera is in its map; nothing before the first correction.
  std::optional<Pose> T_map_cam() const;
};

/// Thread rule: one thread. Messages that cannot be read are counted and passed over.
class SiteWatch {
 public:
  /// True if the message was one of those kept here and could be read.
  bool take(const Delivery& delivery, WatchClock::time_point now);

  const std::map<std::string, HeardRobot>& robots() const { return robots_; }
  const std::optional<CoreStatus>& core() const { return core_; }
  /// In order of their numbers; undone ones too.
  const std::map<uint32_t, MergeRecord>& merges() const { return merges_; }
  /// The last of them, in order of judgement.
  const std::deque<MatchVerdict>& verdicts() const { return verdicts_; }
  const std::map<std::string, size_t>& verdictCounts() const { return counts_; }
  /// Maps that some robot is in, by what the core told them, but not those absorbed since.
  std::set<MapId> maps() const;
  size_t unreadable() const { return unreadable_; }

 private:
  void takeStatus(Status status, WatchClock::time_point now);
  void takeVerdict(MatchVerdict verdict);

  std::map<std::string, HeardRobot> robots_;
  std::optional<CoreStatus> core_;
  std::map<uint32_t, MergeRecord> merges_;
  std::deque<MatchVerdict> verdicts_;
  std::map<std::string, size_t> counts_;
  size_t unreadable_ = 0;
};

/// "ok", "poor", "lost"; "finished"; "silent" if nothing was heard for 5 s; "expected" before its first status.
std::string stateOf(const HeardRobot& robot, WatchClock::time_point now);

/// Keyframes a second that reached the core lately.
double deliveredPerSecond(const HeardRobot& robot, WatchClock::time_point now);

}  // namespace comap
