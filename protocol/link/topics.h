// The topics: their names, and who writes and reads which.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "protocol/link/link.h"

namespace comap {

inline constexpr std::array<Topic, 10> kAllTopics = {
    Topic::kHello, Topic::kKeyframe, Topic::kAck,     Topic::kCorrection, Topic::kInterest,
    Topic::kTile,  Topic::kStatus,   Topic::kVerdict, Topic::kMerge,      Topic::kCoreStatus};

/// "comap/v1/hello" and so on.
std::string topicName(Topic topic);

bool writes(LinkRole role, Topic topic);
bool reads(LinkRole role, Topic topic);
/// Of an observer's topics those that it has only if it has a name: it may ask for tiles, and gets its own.
bool isForNamedObservers(Topic topic);
/// Large, and for one reader alone: repaired at a pace that follows the link's, by one of several writers.
bool isPaced(Topic topic);
/// Written by the core for one robot each, or for a named observer.
bool isToRobots(Topic topic);

/// Where messages of or for `robot`, or to all if it is empty, are written, and where a role reads: DDS partitions. So
/// what is for one robot never travels to another, and a robot that is slow holds nobody else up.
std::string partitionWritten(const std::string& site, const std::string& robot);
std::vector<std::string> partitionsRead(LinkRole role, const std::string& site, const std::string& robot);

/// Of these topics only the newest message matters; it replaces what is not yet delivered.
bool isReplaced(Topic topic);
/// Largest message of a topic. What may be replaced must fit one datagram: Fast DDS (2.9, 2.14) ends a reader's process
/// when a message is replaced of which it has a part.
size_t maxPayloadBytes(Topic topic);

/// How many of the last messages for each robot who joins late still gets, as long as their writer lives.
size_t latchedDepth(Topic topic);

/// "robot", "core" or "observer".
std::string roleName(LinkRole role);

/// What is wrong with publishing so as `role` named `own_name`: kWrongUse, naming topic and robot.
Result<void> checkPublish(LinkRole role, const std::string& own_name, Topic topic, const std::string& robot,
                          size_t payload_bytes);

}  // namespace comap
