#include "protocol/codec/message_checksum.h"

#include <zlib.h>

namespace comap {

uint32_t messageChecksum(std::span<const uint8_t> message) {
  return static_cast<uint32_t>(crc32_z(0, message.data(), message.size()));
}

}  // namespace comap
