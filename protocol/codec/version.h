// The protocol's version, in every message. Another major is refused; a newer minor may add fields, which pass.
#pragma once

#include <cstdint>

namespace comap {

inline constexpr uint32_t kProtocolMajor = 1;
inline constexpr uint32_t kProtocolMinor = 0;

}  // namespace comap
