// The end of a run, and of a change to a store at rest: final poses, maps fused anew, tiles in full detail.
#pragma once

#include <functional>

#include "mapping_core/service/map_builder.h"
#include "protocol/types/tile.h"

namespace comap {

enum class FinishPhase { kMeasuring, kFusing };  ///< keyframes against each other; keyframes into surfels

/// Hears (done, all) keyframes of a phase.
using FinishNews = std::function<void(FinishPhase phase, size_t done, size_t all)>;

/// Settles the poses, ties keyframes that see the same surface, settles again; fuses maps anew whose keyframes moved,
/// and puts poses, tiles and this program's version into the store. `news` may be empty. Returns the tiles, sorted by
/// key.
Result<std::vector<Tile>> finishMaps(MapBuilder& builder, MapStore& store, float min_confidence,
                                     const FinishNews& news);

}  // namespace comap
