#include "protocol/codec/status_codec.h"

#include "comap/v1/status.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Status& status) {
  return codec::Check("status")
      .robot("robot", status.robot)
      .pose("T_odom_cam", status.T_odom_cam)
      .range("tracking", static_cast<double>(status.tracking), 0, 2);
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
  const Status status{message->robot(),
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
  if (const auto checked = check(status); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return status;
}

}  // namespace comap
