// The checksum by which an encoded message is known where it cannot be read: zlib's CRC-32 of its bytes.
#pragma once

#include <cstdint>
#include <span>

namespace comap {

uint32_t messageChecksum(std::span<const uint8_t> message);

}  // namespace comap
