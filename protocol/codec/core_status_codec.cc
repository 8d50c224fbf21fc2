#include "protocol/codec/core_status_codec.h"

#include "comap/v1/core_status.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const CoreStatus& status) { return codec::Check("core_status").text("device", status.device); }

}  // namespace

Result<std::vector<uint8_t>> encodeCoreStatus(const CoreStatus& status) {
  if (const auto checked = check(status); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::CoreStatus message;
  message.set_keyframes(status.keyframes);
  message.set_maps(status.maps);
  message.set_queue(status.queue);
  message.set_device(status.device);
  return codec::serialise(message, "core_status", kMaxSmallMessageBytes);
}

Result<CoreStatus> decodeCoreStatus(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::CoreStatus>(bytes, "core_status", kMaxSmallMessageBytes);
  if (!message) return message.error();
  const CoreStatus status{message->keyframes(), message->maps(), message->queue(), message->device()};
  if (const auto checked = check(status); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return status;
}

}  // namespace comap
