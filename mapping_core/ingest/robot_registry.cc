#include "mapping_core/ingest/robot_registry.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>

#include "protocol/types/counted.h"

namespace comap {
namespace {

std::string hex(uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

// One that was passed over may be mapped after those behind it.
void raise(uint32_t& mapped_below, uint32_t to) { mapped_below = std::max(mapped_below, to); }

}  // namespace

void RobotRegistry::remember(const KeyframeId& keyframe) {
  const auto [it, added] =
      remembered_.try_emplace({keyframe.robot, keyframe.session}, keyframe.robot, keyframe.session);
  it->second.acks.record(keyframe.sequence);
}

void RobotRegistry::markMapped(const KeyframeId& keyframe) {
  const auto it = robots_.find(keyframe.robot);
  if (it != robots_.end() && it->second.session == keyframe.session)
    raise(it->second.mapped_below, keyframe.sequence + 1);
  const auto before = remembered_.find({keyframe.robot, keyframe.session});
  if (before != remembered_.end()) raise(before->second.mapped_below, keyframe.sequence + 1);
}

const RobotRecord* RobotRegistry::alive(const std::string& robot, uint64_t session,
                                        std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::seconds kLate(3);  // what a robot that ended has sent arrives within
  constexpr int kSigns = 2;
  const auto it = robots_.find(robot);
  if (second_of_name_.contains({robot, session})) second_heard_[robot] = now;
  if (it == robots_.end() || second_of_name_.contains({robot, session})) return nullptr;
  RobotRecord& present = it->second;
  if (present.since == std::chrono::steady_clock::time_point()) present.since = now;
  if (present.session == session) present.heard = now;
  const auto earlier = remembered_.find({robot, session});
  if (present.session == session || earlier == remembered_.end()) return nullptr;
  if (now - present.since < kLate || ++present.signs_of_another < kSigns) return nullptr;
  present.refusal = "another robot named '" + robot + "' is alive, its session " + std::to_string(session) +
                    ": give each robot a name of its own";
  if (const uint32_t taken = present.acks.state().next_expected; taken > 0)
    present.refusal += "; what it has delivered (" + counted(taken, "keyframe") +
                       ") stays in the map, as of another start of robot '" + robot + "'";
  const std::pair second(robot, present.session);
  RobotRecord first = std::move(earlier->second);
  remembered_.erase(earlier);
  const auto refused = remembered_.emplace(second, std::move(present)).first;
  robots_.erase(it);
  robots_.emplace(robot, std::move(first));
  second_of_name_.insert(second);
  second_heard_[robot] = now;
  return &refused->second;
}

RobotRecord& RobotRegistry::admit(const Hello& hello) {
  if (second_of_name_.contains({hello.robot, hello.session})) return remembered_.at({hello.robot, hello.session});
  auto it = robots_.find(hello.robot);
  if (it != robots_.end() && it->second.session != hello.session) {
    it->second.refusal.clear();  // that was about its hello; its keyframes are taken from an outbox like all others
    remembered_.erase({hello.robot, it->second.session});
    remembered_.emplace(std::pair(hello.robot, it->second.session), std::move(it->second));  // keyframes may still come
    robots_.erase(it);
    it = robots_.end();
  }
  if (it == robots_.end()) {
    const auto before = remembered_.extract({hello.robot, hello.session});
    if (before) before.mapped().since = {};
    it = robots_.emplace(hello.robot, before ? std::move(before.mapped()) : RobotRecord(hello.robot, hello.session))
             .first;
  }
  RobotRecord& record = it->second;
  record.refusal = hello.fern_book_hash == fern_book_hash_
                       ? std::string()
                       : "fern book " + hex(hello.fern_book_hash) + " differs from the core's " + hex(fern_book_hash_) +
                             ": robot and core must run builds or configurations with the same ferns";
  return record;
}

bool RobotRegistry::refuses(const std::string& robot, std::chrono::steady_clock::time_point now) const {
  constexpr std::chrono::minutes kLately(5);
  const auto present = robots_.find(robot);
  if (present != robots_.end() && !present->second.refusal.empty()) return true;
  const auto second = second_heard_.find(robot);
  return second != second_heard_.end() && now - second->second < kLately;
}

RobotRecord* RobotRegistry::served(const std::string& robot, uint64_t session) {
  const auto it = robots_.find(robot);
  if (it == robots_.end() || it->second.session != session || !it->second.refusal.empty()) return nullptr;
  return &it->second;
}

RobotRecord* RobotRegistry::delivering(const std::string& robot, uint64_t session) {
  const auto it = robots_.find(robot);
  if (it == robots_.end() || !it->second.refusal.empty() || session > it->second.session) return nullptr;
  if (second_of_name_.contains({robot, session})) return nullptr;  // its clock may be behind the first one's
  if (session == it->second.session) return &it->second;
  return &remembered_.try_emplace({robot, session}, robot, session).first->second;
}

Acknowledgement acknowledgementOf(const RobotRecord& record) {
  Acknowledgement ack = record.acks.state();
  ack.mapped_below = record.mapped_below;
  ack.refusal = record.refusal;
  return ack;
}

}  // namespace comap
