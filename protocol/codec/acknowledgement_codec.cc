#include "protocol/codec/acknowledgement_codec.h"

#include <algorithm>
#include <functional>

#include "comap/v1/ack.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Acknowledgement& acknowledgement) {
  const auto& held = acknowledgement.also_held;
  const bool ascending = std::adjacent_find(held.begin(), held.end(), std::greater_equal<>()) == held.end() &&
                         (held.empty() || held.front() > acknowledgement.next_expected);
  return codec::Check("ack")
      .robot("robot", acknowledgement.robot)
      .count("also_held", held.size(), kMaxAlsoHeld)
      .that(ascending, "also_held", "is not strictly ascending and above next_expected")
      .text("refusal", acknowledgement.refusal)
      .text("refused", acknowledgement.refused);
}

}  // namespace

Result<std::vector<uint8_t>> encodeAcknowledgement(const Acknowledgement& acknowledgement) {
  if (const auto checked = check(acknowledgement); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Acknowledgement message;
  message.set_robot(acknowledgement.robot);
  message.set_session(acknowledgement.session);
  message.set_next_expected(acknowledgement.next_expected);
  message.mutable_also_held()->Add(acknowledgement.also_held.begin(), acknowledgement.also_held.end());
  message.set_mapped_below(acknowledgement.mapped_below);
  message.set_refusal(acknowledgement.refusal);
  message.set_refused(acknowledgement.refused);
  message.set_refused_checksum(acknowledgement.refused_checksum);
  return codec::serialise(message, "ack", kMaxListMessageBytes);
}

Result<Acknowledgement> decodeAcknowledgement(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Acknowledgement>(bytes, "ack", kMaxListMessageBytes);
  if (!message) return message.error();
  Acknowledgement acknowledgement{
      message->robot(),        message->session(), message->next_expected(), {},
      message->mapped_below(), message->refusal(), message->refused(),       message->refused_checksum()};
  const auto sized =
      codec::Check("ack").count("also_held", static_cast<size_t>(message->also_held_size()), kMaxAlsoHeld);
  if (!sized.ok()) return sized.error(ErrorCode::kBadData);
  acknowledgement.also_held.assign(message->also_held().begin(), message->also_held().end());
  if (const auto checked = check(acknowledgement); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return acknowledgement;
}

}  // namespace comap
