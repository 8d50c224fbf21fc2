// The topics: their names, and who writes and reads which.
#pragma once

#include <array>
#include <string>

#include "protocol/link/link.h"

namespace comap {

inline constexpr std::array<Topic, 10> kAllTopics = {
    Topic::kHello, Topic::kKeyframe, Topic::kAck,     Topic::kCorrection, Topic::kInterest,
    Topic::kTile,  Topic::kStatus,   Topic::kVerdict, Topic::kMerge,      Topic::kCoreStatus};

/// "comap/v1/hello" and so on.
std::string topicName(Topic topic);

bool writes(LinkRole role, Topic topic);
bool reads(LinkRole role, Topic topic);

/// How many of the last messages for each robot who joins late still gets, as long as their writer lives.
size_t latchedDepth(Topic topic);

/// "robot", "core" or "observer".
std::string roleName(LinkRole role);

/// What is wrong with publishing so as `role` named `own_name`: kWrongUse, naming topic and robot.
Result<void> checkPublish(LinkRole role, const std::string& own_name, Topic topic, const std::string& robot,
                          size_t payload_bytes);

}  // namespace comap
