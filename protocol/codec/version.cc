#include "protocol/codec/version.h"

#include "comap/v1/common.pb.h"
#include "protocol/codec/envelope.h"

namespace comap {

std::string otherProtocol(std::span<const uint8_t> message) {
  v1::Envelope envelope;
  if (!envelope.ParseFromArray(message.data(), static_cast<int>(message.size()))) return {};
  if (envelope.protocol_major() == kProtocolMajor || envelope.protocol_major() == 0) return {};
  return "protocol major " + std::to_string(envelope.protocol_major()) + ", this build speaks " +
         std::to_string(kProtocolMajor) + ": robot and core must run versions that fit";
}

}  // namespace comap
