// The protocol's version, in every message. Another major is refused; a newer minor may add fields, which pass.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace comap {

inline constexpr uint32_t kProtocolMajor = 1;
inline constexpr uint32_t kProtocolMinor = 0;

/// What is wrong if an encoded message is of another major; empty if it is of this one, or damaged.
std::string otherProtocol(std::span<const uint8_t> message);

}  // namespace comap
