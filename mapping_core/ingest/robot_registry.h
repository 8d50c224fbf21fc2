// Who is there: robots, their sessions, what they have delivered, where they are, what they were told.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "protocol/session/ack_tracker.h"
#include "protocol/types/messages.h"

namespace comap {

struct RobotRecord {
  RobotRecord(const std::string& robot, uint64_t its_session) : session(its_session), acks(robot, its_session) {}

  uint64_t session;
  std::string refusal;  ///< why the present session is not served; empty = served
  AckTracker acks;
  uint32_t mapped_below = 0;  ///< of this session all are in the map, but those passed over
  std::optional<Interest> interest;
  std::optional<Correction> correction;  ///< the last one sent
  bool finished = false;
  std::chrono::steady_clock::time_point since{};  ///< when this session was first seen alive
  std::chrono::steady_clock::time_point heard{};  ///< and last
  int signs_of_another = 0;                       ///< an earlier session lives on
};

/// Thread rule: one thread.
class RobotRegistry {
 public:
  explicit RobotRegistry(uint64_t fern_book_hash) : fern_book_hash_(fern_book_hash) {}

  /// A keyframe that an earlier core took in: when the robot's session says hello, it is acknowledged.
  void remember(const KeyframeId& keyframe);
  /// A keyframe is in the map.
  void markMapped(const KeyframeId& keyframe);

  /// A robot introduces itself; a new session replaces the old one. The record's `refusal` tells if it is not served.
  RobotRecord& admit(const Hello& hello);
  /// The record for a keyframe: of the robot's present session, or of an earlier one, which its outbox has kept. Null
  /// if the robot never said hello or is refused, or the session is a later one.
  RobotRecord* delivering(const std::string& robot, uint64_t session);
  /// A sign of life of a robot. If an earlier session of its name lives on beside a newer one there are two robots of
  /// one name: the first keeps it, and the record of the second comes back with its refusal. Null else. What the second
  /// has delivered was acknowledged and is nowhere else: it stays, as what another start of the robot has seen.
  const RobotRecord* alive(const std::string& robot, uint64_t session, std::chrono::steady_clock::time_point now);
  /// Whether a robot of this name is not served: its present session, or a second one that was heard in the last five
  /// minutes. (A refused agent ends; what starts it again may take its time.)
  bool refuses(const std::string& robot, std::chrono::steady_clock::time_point now) const;
  /// The record for a message of this robot and session; null if it never said hello, is refused, or the session is
  /// old.
  RobotRecord* served(const std::string& robot, uint64_t session);
  std::map<std::string, RobotRecord>& robots() { return robots_; }
  const std::map<std::string, RobotRecord>& robots() const { return robots_; }

 private:
  uint64_t fern_book_hash_;
  std::map<std::string, RobotRecord> robots_;
  std::map<std::pair<std::string, uint64_t>, RobotRecord> remembered_;         // other sessions: of earlier starts
  std::set<std::pair<std::string, uint64_t>> second_of_name_;                  // refused, among the remembered
  std::map<std::string, std::chrono::steady_clock::time_point> second_heard_;  // last, by name
};

/// What the robot is told of its keyframes.
Acknowledgement acknowledgementOf(const RobotRecord& record);

}  // namespace comap
