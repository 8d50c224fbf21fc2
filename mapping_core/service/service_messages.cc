// The part of MappingService that hears: what robots and observers say, and what they are told at once.
#include "mapping_core/service/mapping_service.h"
#include "protocol/codec/codec.h"
#include "protocol/codec/message_checksum.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

constexpr size_t kMaxRefusalBytes = 600;  // an acknowledgement has to fit one datagram
constexpr size_t kMaxReasonBytes = 200;   // as that may go beside the keyframes held

}  // namespace

Result<void> MappingService::handle(const Delivery& delivery) {
  switch (delivery.topic) {
    case Topic::kHello: {
      const auto hello = decodeHello(delivery.payload);
      if (!hello) {
        refuse(delivery, hello.error().text);
        Acknowledgement refusal;  // of which session cannot be read
        refusal.robot = delivery.robot;
        refusal.refusal = hello.error().text.substr(0, kMaxRefusalBytes);
        send(Topic::kAck, delivery.robot, encodeAcknowledgement(refusal));
        return {};
      }
      const bool again = registry_.served(hello->robot, hello->session) != nullptr;
      const RobotRecord& record = registry_.admit(*hello);
      if (!again) noteHello(hello->robot, record.refusal);
      send(Topic::kAck, hello->robot, encodeAcknowledgement(acknowledgementOf(record)));
      return {};
    }
    case Topic::kKeyframe:
      return handleKeyframe(delivery);
    case Topic::kInterest:
      return handleInterest(delivery);
    case Topic::kStatus: {
      const auto status = decodeStatus(delivery.payload);
      if (!status) {
        refuse(delivery, status.error().text);
        return {};
      }
      noteAlive(status->robot, status->session);
      if (RobotRecord* record = registry_.served(status->robot, status->session)) {
        record->finished = status->finished;
        presence_.note(status->robot, !status->finished);
      }
      goOnWithout(*status);
      return {};
    }
    default:
      refuse(delivery, "topic that the core does not read");
      return {};
  }
}

void MappingService::noteHello(const std::string& robot, const std::string& refusal) {
  if (!refusal.empty()) return error("robot " + robot + " refused: " + refusal);
  info("robot " + robot + " is here");
  presence_.note(robot, true);
}

void MappingService::noteAlive(const std::string& robot, uint64_t session) {
  const RobotRecord* second = registry_.alive(robot, session, std::chrono::steady_clock::now());
  if (second == nullptr) return;
  noteHello(robot, second->refusal);
  send(Topic::kAck, robot, encodeAcknowledgement(acknowledgementOf(*second)));
}

// What hangs on a keyframe that cannot be taken is tied to what that one hangs on.
void MappingService::goOnWithout(const Status& status) {
  for (const RefusedKeyframe& refused : status.refused) {
    const RobotRecord* record = registry_.delivering(status.robot, refused.session);
    if (record == nullptr || !record->acks.accepts(refused.sequence)) continue;
    const KeyframeId id{status.robot, refused.session, refused.sequence};
    if (ingest_.passOver(id, refused.link))
      info("goes on without keyframe " + toString(id) + ", which it could not take; should it come yet, it is mapped");
  }
}

Result<void> MappingService::handleKeyframe(const Delivery& delivery) {
  const StageSpan span("receive");
  const auto head = decodeKeyframeId(delivery.payload);
  if (!head) {
    refuseKeyframe(delivery, head.error().text);
    return {};
  }
  RobotRecord* record = registry_.delivering(head->id.robot, head->id.session);
  if (record == nullptr) {
    refuse(delivery, "keyframe " + toString(head->id) + " of a robot that is not admitted");
    return {};
  }
  if (!record->acks.accepts(head->id.sequence)) {
    refuse(delivery, "keyframe " + toString(head->id) + " is too far ahead of what the core holds");
    return {};
  }
  if (!store_health_.holds()) return {};  // not acknowledged: its robot keeps it and sends it again
  const auto arrival = ingest_.ingest(delivery.payload);
  if (!arrival) {
    if (arrival.error().code == ErrorCode::kUnreachable) {
      store_health_.note(arrival.error(), delivery.payload.size());
      return {};  // as above
    }
    if (arrival.error().code != ErrorCode::kBadData) return arrival.error();
    refuseKeyframe(delivery, arrival.error().text);
    return {};
  }
  if (arrival->is_new) robot_index_.try_emplace(arrival->id.robot, static_cast<uint32_t>(robot_index_.size()));
  if (!store_health_.holds()) return {};
  if (arrival->is_new) store_health_.note({});
  for (const KeyframeId& skipped : arrival->skipped) record->acks.record(skipped.sequence);
  record->acks.record(arrival->id.sequence);
  statistics_.uplink_bytes[arrival->id.robot] += delivery.payload.size();
  if (arrival->is_new) load_.arrived(std::chrono::steady_clock::now());
  send(Topic::kAck, arrival->id.robot, encodeAcknowledgement(acknowledgementOf(*record)));
  return {};
}

Result<void> MappingService::handleInterest(const Delivery& delivery) {
  const auto interest = decodeInterest(delivery.payload);
  if (!interest) {
    refuse(delivery, interest.error().text);
    return {};
  }
  if (interest->session == 0)
    return registry_.robots().contains(interest->robot) ? Result<void>() : delivery_.answerObserver(*interest);
  RobotRecord* record = registry_.served(interest->robot, interest->session);
  return record == nullptr ? Result<void>() : delivery_.answer(*record, *interest);
}

void MappingService::refuse(const Delivery& delivery, const std::string& why) {
  ++statistics_.refused_messages;
  info("message from '" + delivery.robot + "' refused: " + why);
}

// Its robot is told, which would send it again and again else.
void MappingService::refuseKeyframe(const Delivery& delivery, const std::string& why) {
  refuse(delivery, why);
  const auto robot = registry_.robots().find(delivery.robot);
  if (robot == registry_.robots().end()) return;  // nothing is known yet that an acknowledgement could say
  Acknowledgement told = acknowledgementOf(robot->second);
  told.refused = why.substr(0, kMaxReasonBytes);
  told.refused_checksum = messageChecksum(delivery.payload);
  send(Topic::kAck, delivery.robot, encodeAcknowledgement(told));
}

}  // namespace comap
