// A tile's surfels as bytes on disk: 14 each, little endian, in one zstd frame with a checksum.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap {

inline constexpr size_t kTileSurfelBytes = 14;
inline constexpr size_t kMaxStoredTileSurfels = size_t{1} << 22;

/// At most kMaxStoredTileSurfels.
std::vector<uint8_t> compressSurfels(std::span<const TileSurfel> surfels);
/// kBadData if the frame is damaged or does not hold `count` surfels.
Result<std::vector<TileSurfel>> decompressSurfels(std::span<const uint8_t> frame, int64_t count);

}  // namespace comap
