// What a message may hold at most. Checked before memory is taken for it, on both ends.
#pragma once

#include <cstddef>

namespace comap {

inline constexpr int kMinImageSide = 16, kMaxImageSide = 4096;  ///< pixels
inline constexpr size_t kMaxFerns = 4000;
inline constexpr uint32_t kMaxSkipped = 60000;  ///< sequences before a keyframe that never come
inline constexpr size_t kMaxTileSurfels = size_t{1} << 20;
inline constexpr size_t kMaxTilePlaces = 256;
inline constexpr size_t kMaxHeldTiles = size_t{1} << 15;
inline constexpr size_t kMaxAlsoHeld = size_t{1} << 16;
inline constexpr size_t kMaxRefusedTold = 16;  ///< of a status
inline constexpr size_t kMaxMergeRobots = 256;
inline constexpr size_t kMaxMergeVoters = 4096;
inline constexpr size_t kMaxTextBytes = 1024;  ///< refusals, versions, device names, reasons
inline constexpr size_t kMaxMapIdBytes = 96;
inline constexpr double kMaxTranslation_m = 1e6;

inline constexpr size_t kMaxLargeMessageBytes = size_t{16} << 20;  ///< keyframes, tiles
inline constexpr size_t kMaxListMessageBytes = size_t{1} << 20;    ///< ack, interest, merge
inline constexpr size_t kMaxSmallMessageBytes = size_t{64} << 10;  ///< all others

}  // namespace comap
