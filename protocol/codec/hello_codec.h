// Hello <-> bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

/// kWrongUse, naming the field, if a value breaks a limit.
Result<std::vector<uint8_t>> encodeHello(const Hello& hello);
/// kBadData for damaged bytes, another protocol major, or a value beyond its limit.
Result<Hello> decodeHello(std::span<const uint8_t> bytes);

}  // namespace comap
