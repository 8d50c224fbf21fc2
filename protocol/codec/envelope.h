// Bytes <-> one Protobuf message, with size limit and protocol version. Inside the codec only.
#pragma once

#include <google/protobuf/stubs/logging.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "comap/v1/common.pb.h"
#include "protocol/codec/version.h"
#include "protocol/types/result.h"

namespace comap::codec {

// Protobuf would print a line for each message it refuses; whoever sends rubbish shall not fill our log.
inline const bool kProtobufIsQuiet = (google::protobuf::SetLogHandler(nullptr), true);

template <class Message>
Result<Message> parse(std::span<const uint8_t> bytes, const std::string& name, size_t limit) {
  if (bytes.size() > limit) {
    return Error{ErrorCode::kBadData,
                 name + ": " + std::to_string(bytes.size()) + " bytes, expected at most " + std::to_string(limit)};
  }
  Message message;
  const bool parsed = message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  uint32_t major = parsed ? message.protocol_major() : kProtocolMajor;
  if (!parsed) {
    // Another major may have given a field another type: then that is the reason worth telling.
    v1::Envelope envelope;
    if (envelope.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) major = envelope.protocol_major();
  }
  if (major != kProtocolMajor) {
    return Error{ErrorCode::kBadData, name + ": protocol major " + std::to_string(major) + ", this build speaks " +
                                          std::to_string(kProtocolMajor)};
  }
  if (!parsed) {
    return Error{ErrorCode::kBadData, name + ": " + std::to_string(bytes.size()) +
                                          " bytes are not a whole message of protocol " +
                                          std::to_string(kProtocolMajor)};
  }
  return message;
}

/// Sets the version and gives the bytes; kWrongUse beyond `limit`.
template <class Message>
Result<std::vector<uint8_t>> serialise(Message& message, const std::string& name, size_t limit) {
  message.set_protocol_major(kProtocolMajor);
  message.set_protocol_minor(kProtocolMinor);
  const size_t size = message.ByteSizeLong();
  if (size > limit) {
    return Error{ErrorCode::kWrongUse,
                 name + ": would take " + std::to_string(size) + " bytes, expected at most " + std::to_string(limit)};
  }
  std::vector<uint8_t> bytes(size);
  message.SerializeWithCachedSizesToArray(bytes.data());
  return bytes;
}

}  // namespace comap::codec
