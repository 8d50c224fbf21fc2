// Short codes that only who has the key could have made.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace comap {

/// The first half of the HMAC-SHA-256 of `message` under `key`.
std::array<uint8_t, 16> authenticationCode(std::span<const uint8_t> key, std::span<const uint8_t> message);

}  // namespace comap
