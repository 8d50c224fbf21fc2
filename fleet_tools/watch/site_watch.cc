#include "fleet_tools/watch/site_watch.h"

#include <algorithm>

#include "protocol/codec/codec.h"

namespace comap {
namespace {

constexpr size_t kMostVerdicts = 4000, kMostRobots = 256, kMostMerges = 10000;
constexpr std::chrono::seconds kSilent(5), kRateWindow(10);

}  // namespace

std::optional<Pose> HeardRobot::T_map_cam() const {
  if (!has_status || !correction || correction->session != status.session) return std::nullopt;
  return correction->T_map_odom * status.T_odom_cam;
}

bool SiteWatch::take(const Delivery& delivery, WatchClock::time_point now) {
  const auto known = [&](const std::string& robot) { return robots_.contains(robot) || robots_.size() < kMostRobots; };
  switch (delivery.topic) {
    case Topic::kHello: {
      const auto hello = decodeHello(delivery.payload);
      if (!hello) break;
      if (known(hello->robot)) robots_[hello->robot].heard = now;
      return true;
    }
    case Topic::kStatus: {
      auto status = decodeStatus(delivery.payload);
      if (!status) break;
      if (known(status->robot)) takeStatus(std::move(*status), now);
      return true;
    }
    case Topic::kCorrection: {
      auto correction = decodeCorrection(delivery.payload);
      if (!correction) break;
      if (known(correction->robot)) robots_[correction->robot].correction = std::move(*correction);
      return true;
    }
    case Topic::kVerdict: {
      auto verdict = decodeMatchVerdict(delivery.payload);
      if (!verdict) break;
      takeVerdict(std::move(*verdict));
      return true;
    }
    case Topic::kMerge: {
      auto merge = decodeMergeRecord(delivery.payload);
      if (!merge) break;
      if (merges_.size() < kMostMerges || merges_.contains(merge->number)) merges_[merge->number] = std::move(*merge);
      return true;
    }
    case Topic::kCoreStatus: {
      auto core = decodeCoreStatus(delivery.payload);
      if (!core) break;
      core_ = std::move(*core);
      return true;
    }
    default:
      return false;
  }
  ++unreadable_;
  return false;
}

void SiteWatch::takeStatus(Status status, WatchClock::time_point now) {
  HeardRobot& robot = robots_[status.robot];
  if (robot.has_status && robot.status.session != status.session) robot.delivered.clear();
  const int64_t delivered = int64_t{status.keyframes} - int64_t{status.outbox};
  robot.delivered.emplace_back(now, delivered);
  while (now - robot.delivered.front().first > kRateWindow) robot.delivered.pop_front();
  robot.status = std::move(status);
  robot.has_status = true;
  robot.heard = now;
}

void SiteWatch::takeVerdict(MatchVerdict verdict) {
  constexpr size_t kMostReasons = 64;  // a site without keys may say anything
  const std::string reason = verdict.accepted ? "accepted" : verdict.reason;
  ++counts_[counts_.contains(reason) || counts_.size() < kMostReasons ? reason : "other"];
  verdicts_.push_back(std::move(verdict));
  if (verdicts_.size() > kMostVerdicts) verdicts_.pop_front();
}

std::set<MapId> SiteWatch::maps() const {
  std::set<MapId> maps;
  for (const auto& [name, robot] : robots_)
    if (robot.correction) maps.insert(robot.correction->map);
  // A robot that is gone may have been told of a map that is part of another by now.
  for (const auto& [number, merge] : merges_)
    if (merge.undone.empty()) maps.erase(merge.absorbed);
  return maps;
}

std::string stateOf(const HeardRobot& robot, WatchClock::time_point now) {
  if (!robot.has_status) return "expected";
  if (robot.status.finished) return "finished";
  if (now - robot.heard > kSilent) return "silent";
  switch (robot.status.tracking) {
    case TrackingState::kOk:
      return "ok";
    case TrackingState::kPoor:
      return "poor";
    case TrackingState::kLost:
      return "lost";
  }
  return "silent";
}

double deliveredPerSecond(const HeardRobot& robot, WatchClock::time_point now) {
  if (robot.delivered.empty()) return 0;
  const double since_s = std::chrono::duration<double>(now - robot.delivered.front().first).count();
  const auto more = static_cast<double>(robot.status.keyframes) - static_cast<double>(robot.status.outbox) -
                    static_cast<double>(robot.delivered.front().second);
  return since_s < 1 ? 0 : std::max(0.0, more / since_s);
}

}  // namespace comap
