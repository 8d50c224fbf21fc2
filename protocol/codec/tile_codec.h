// Tile <-> bytes: surfels as 14 columns, zstd.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap {

/// kWrongUse, naming the field, if a value breaks a limit.
Result<std::vector<uint8_t>> encodeTile(const Tile& tile);
/// kBadData for damaged bytes, another protocol major, or a value beyond its limit.
Result<Tile> decodeTile(std::span<const uint8_t> bytes);

}  // namespace comap
