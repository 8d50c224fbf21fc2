#include "protocol/codec/correction_codec.h"

#include "comap/v1/correction.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Correction& correction) {
  return codec::Check("correction")
      .robot("robot", correction.robot)
      .map("map", correction.map)
      .pose("T_map_odom", correction.T_map_odom);
}

}  // namespace

Result<std::vector<uint8_t>> encodeCorrection(const Correction& correction) {
  if (const auto checked = check(correction); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Correction message;
  message.set_robot(correction.robot);
  message.set_session(correction.session);
  message.set_map(correction.map);
  codec::write(correction.T_map_odom, message.mutable_t_map_odom());
  message.set_revision(correction.revision);
  return codec::serialise(message, "correction", kMaxSmallMessageBytes);
}

Result<Correction> decodeCorrection(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Correction>(bytes, "correction", kMaxSmallMessageBytes);
  if (!message) return message.error();
  const auto T_map_odom = codec::readPose(message->t_map_odom(), "correction: T_map_odom");
  if (!T_map_odom) return T_map_odom.error();
  const Correction correction{message->robot(), message->session(), message->map(), *T_map_odom, message->revision()};
  if (const auto checked = check(correction); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return correction;
}

}  // namespace comap
