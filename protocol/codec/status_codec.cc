#include "protocol/codec/status_codec.h"

#include "comap/v1/status.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Status& status) {
  codec::Check check("status");
  check.robot("robot", status.robot)
      .pose("T_odom_cam", status.T_odom_cam)
      .range("tracking", static_cast<double>(status.tracking), 0, 2)
      .count("refused", status.refused.size(), kMaxRefusedTold);
  for (const RefusedKeyframe& refused : status.refused) {
    if (!refused.link.linked) continue;
    check.pose("refused: T_link_this", refused.link.T_link_this)
        .information("refused: information", refused.link.information)
        .that(refused.link.linked_to < refused.sequence, "refused: linked_to",
              "is " + std::to_string(refused.link.linked_to) + ", expected less than the keyframe's own " +
                  std::to_string(refused.sequence));
  }
  return check;
}

void write(const RefusedKeyframe& refused, v1::RefusedKeyframe* to) {
  to->set_session(refused.session);
  to->set_sequence(refused.sequence);
  to->set_linked(refused.link.linked);
  if (!refused.link.linked) return;
  to->set_linked_to(refused.link.linked_to);
  codec::write(refused.link.T_link_this, to->mutable_t_link_this());
  codec::write(refused.link.information, to->mutable_information());
}

Result<RefusedKeyframe> read(const v1::RefusedKeyframe& from) {
  RefusedKeyframe refused{from.session(), from.sequence()};
  refused.link.linked = from.linked();
  if (!from.linked()) return refused;
  refused.link.linked_to = from.linked_to();
  const auto T_link_this = codec::readPose(from.t_link_this(), "status: refused: T_link_this");
  if (!T_link_this) return T_link_this.error();
  refused.link.T_link_this = *T_link_this;
  const auto information = codec::readInformation(from.information(), "status: refused: information");
  if (!information) return information.error();
  refused.link.information = *information;
  return refused;
}

}  // namespace

Result<std::vector<uint8_t>> encodeStatus(const Status& status) {
  if (const auto checked = check(status); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Status message;
  message.set_robot(status.robot);
  message.set_session(status.session);
  message.set_stamp_ns(status.stamp_ns);
  codec::write(status.T_odom_cam, message.mutable_t_odom_cam());
  message.set_tracking(static_cast<v1::TrackingState>(status.tracking));
  message.set_frames(status.frames);
  message.set_keyframes(status.keyframes);
  message.set_outbox(status.outbox);
  message.set_finished(status.finished);
  message.set_outbox_bytes(status.outbox_bytes);
  message.set_keyframes_thinned(status.keyframes_thinned);
  message.set_keyframes_dropped(status.keyframes_dropped);
  message.set_keyframes_refused(status.keyframes_refused);
  for (const RefusedKeyframe& refused : status.refused) write(refused, message.add_refused());
  return codec::serialise(message, "status", kMaxSmallMessageBytes);
}

Result<Status> decodeStatus(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Status>(bytes, "status", kMaxSmallMessageBytes);
  if (!message) return message.error();
  const auto T_odom_cam = codec::readPose(message->t_odom_cam(), "status: T_odom_cam");
  if (!T_odom_cam) return T_odom_cam.error();
  // Checked before the cast, which would fold 256 onto 0.
  const auto known = codec::Check("status").range("tracking", static_cast<double>(message->tracking()), 0, 2);
  if (!known.ok()) return known.error(ErrorCode::kBadData);
  Status status{message->robot(),
                message->session(),
                message->stamp_ns(),
                *T_odom_cam,
                static_cast<TrackingState>(message->tracking()),
                message->frames(),
                message->keyframes(),
                message->outbox(),
                message->finished(),
                message->outbox_bytes(),
                message->keyframes_thinned(),
                message->keyframes_dropped(),
                message->keyframes_refused()};
  for (const v1::RefusedKeyframe& one : message->refused()) {
    auto refused = read(one);
    if (!refused) return refused.error();
    status.refused.push_back(std::move(*refused));
  }
  if (const auto checked = check(status); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return status;
}

}  // namespace comap
