// Zstandard sections with a known size: refused before memory is taken if they claim another. Inside the codec only.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap::codec {

std::vector<uint8_t> compress(std::span<const uint8_t> raw, int level);

/// kBadData unless `packed` is one zstd frame that says it holds `raw_size` bytes and does.
Result<std::vector<uint8_t>> decompress(std::span<const uint8_t> packed, size_t raw_size, const std::string& name);

}  // namespace comap::codec
