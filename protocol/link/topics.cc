#include "protocol/link/topics.h"

#include "protocol/codec/limits.h"
#include "protocol/types/ids.h"

namespace comap {
namespace {

constexpr size_t kMaxReplacedBytes = 950;  // fits one datagram of 1400 bytes beside what DDS adds, keys included

}  // namespace

std::string topicName(Topic topic) {
  switch (topic) {
    case Topic::kHello:
      return "comap/v1/hello";
    case Topic::kKeyframe:
      return "comap/v1/keyframe";
    case Topic::kAck:
      return "comap/v1/ack";
    case Topic::kCorrection:
      return "comap/v1/correction";
    case Topic::kInterest:
      return "comap/v1/interest";
    case Topic::kTile:
      return "comap/v1/tile";
    case Topic::kStatus:
      return "comap/v1/status";
    case Topic::kVerdict:
      return "comap/v1/verdict";
    case Topic::kMerge:
      return "comap/v1/merge";
    case Topic::kCoreStatus:
      return "comap/v1/core_status";
  }
  return {};
}

bool writes(LinkRole role, Topic topic) {
  switch (topic) {
    case Topic::kHello:
    case Topic::kKeyframe:
    case Topic::kStatus:
      return role == LinkRole::kRobot;
    case Topic::kInterest:
      return role != LinkRole::kCore;
    default:
      return role == LinkRole::kCore;
  }
}

bool reads(LinkRole role, Topic topic) {
  switch (role) {
    case LinkRole::kRobot:
      return topic == Topic::kAck || topic == Topic::kCorrection || topic == Topic::kTile;
    case LinkRole::kCore:
      return writes(LinkRole::kRobot, topic);
    case LinkRole::kObserver:
      return topic != Topic::kKeyframe && topic != Topic::kAck && topic != Topic::kInterest;
  }
  return false;
}

bool isForNamedObservers(Topic topic) { return topic == Topic::kInterest || topic == Topic::kTile; }

bool isPaced(Topic topic) { return topic == Topic::kKeyframe || topic == Topic::kInterest || topic == Topic::kTile; }

bool isToRobots(Topic topic) { return reads(LinkRole::kRobot, topic); }

std::string partitionWritten(const std::string& site, const std::string& robot) {
  return robot.empty() ? site : site + "/" + robot;
}

std::vector<std::string> partitionsRead(LinkRole role, const std::string& site, const std::string& robot) {
  switch (role) {
    case LinkRole::kRobot:
      return {site + "/" + robot};
    case LinkRole::kCore:
      return {site + "/*"};
    case LinkRole::kObserver:
      return {site, site + "/*"};
  }
  return {};
}

bool isReplaced(Topic topic) {
  switch (topic) {
    case Topic::kHello:
    case Topic::kAck:
    case Topic::kCorrection:
    case Topic::kStatus:
    case Topic::kCoreStatus:
      return true;
    default:
      return false;
  }
}

size_t maxPayloadBytes(Topic topic) { return isReplaced(topic) ? kMaxReplacedBytes : kMaxLargeMessageBytes; }

size_t latchedDepth(Topic topic) {
  switch (topic) {
    case Topic::kHello:
    case Topic::kAck:
    case Topic::kCorrection:
    case Topic::kCoreStatus:
      return 1;
    case Topic::kVerdict:
    case Topic::kMerge:
      return 256;
    default:
      return 0;
  }
}

std::string roleName(LinkRole role) {
  return role == LinkRole::kRobot ? "robot" : role == LinkRole::kCore ? "core" : "observer";
}

Result<void> checkPublish(LinkRole role, const std::string& own_name, Topic topic, const std::string& robot,
                          size_t payload_bytes) {
  const std::string where = topicName(topic) + ": ";
  if (!writes(role, topic)) return Error{ErrorCode::kWrongUse, where + roleName(role) + " does not write this topic"};
  if (role == LinkRole::kObserver && own_name.empty())
    return Error{ErrorCode::kWrongUse, where + "an observer without a name only listens"};
  if (role != LinkRole::kCore && robot != own_name) {
    return Error{ErrorCode::kWrongUse, where + roleName(role) + " '" + own_name + "' cannot write as '" + robot + "'"};
  }
  if (robot.empty() && isToRobots(topic)) return Error{ErrorCode::kWrongUse, where + "for no robot"};
  if (!robot.empty()) {
    if (const std::string problem = robotNameProblem(robot); !problem.empty()) {
      return Error{ErrorCode::kWrongUse, where + problem};
    }
  }
  if (payload_bytes > maxPayloadBytes(topic)) {
    return Error{ErrorCode::kWrongUse, where + std::to_string(payload_bytes) + " bytes, expected at most " +
                                           std::to_string(maxPayloadBytes(topic))};
  }
  return {};
}

}  // namespace comap
