// The end of a run, and of a change to a store at rest: final poses, maps fused anew, tiles in full detail.
#pragma once

#include <functional>

#include "mapping_core/service/map_builder.h"
#include "protocol/types/tile.h"

namespace comap {

/// Settles the poses, ties keyframes that see the same surface, settles again; fuses maps anew whose keyframes moved,
/// and puts poses, tiles and this program's version into the store. `progress` (may be empty) hears (done, all)
/// keyframes. Returns the tiles, sorted by key.
Result<std::vector<Tile>> finishMaps(MapBuilder& builder, MapStore& store, float min_confidence,
                                     const std::function<void(size_t, size_t)>& progress);

}  // namespace comap
