// Cuts the surfels of a core's maps into tiles while the maps grow.
#pragma once

#include <map>

#include "mapping_core/service/map_builder.h"
#include "mapping_core/tiles/tile_cutter.h"
#include "mapping_core/tiles/tile_index.h"

namespace comap {

/// Thread rule: one thread.
class LiveTiles {
 public:
  explicit LiveTiles(const TileOptions& options);

  /// Tiles of the map anchored at `anchor` that have changed since they were last cut, with their places: what
  /// TileIndex::change() takes. `current`: what it has been given so far. Errors are the device's.
  Result<std::vector<Tile>> cut(MapBuilder& builder, const KeyframeId& anchor, const TileIndex& current);
  /// Maps that are no more.
  void keepOnly(const ComponentSet& components);

 private:
  TileOptions options_;
  std::map<KeyframeId, TileCutter> cutters_;  // by anchor
  RowWorkers workers_;
};

}  // namespace comap
