#include "mapping_core/service/map_finish.h"

#include "mapping_core/tiles/tile_builder.h"

namespace comap {

Result<std::vector<Tile>> finishMaps(MapBuilder& builder, MapStore& store, float min_confidence,
                                     const FinishNews& news) {
  const auto tellOf = [&](FinishPhase phase) {
    return [&news, phase](size_t done, size_t all) {
      if (news) news(phase, done, all);
    };
  };
  // Ties are measured from where the map has a pair: from poses that themselves do not depend on how they came to be.
  if (auto untied = builder.untie(); !untied) return untied.error();
  if (auto settled = builder.settle(); !settled) return settled.error();
  if (auto refined = builder.refine(tellOf(FinishPhase::kMeasuring)); !refined) return refined.error();
  if (auto settled = builder.settle(); !settled) return settled.error();
  if (auto stored = builder.storePoses(); !stored) return stored.error();
  if (auto rebuilt = builder.rebuild(tellOf(FinishPhase::kFusing)); !rebuilt) return rebuilt.error();
  std::vector<Tile> all;
  TileOptions options;
  options.min_confidence = min_confidence;
  for (const KeyframeId& anchor : builder.components().anchors()) {
    auto surfels = builder.surfels(anchor).download();
    if (!surfels) return surfels.error();
    for (Tile& tile : buildTiles(mapIdOf(anchor), *surfels, options)) all.push_back(std::move(tile));
  }
  if (auto stored = store.setTiles(all); !stored) return stored.error();
  if (auto stored = store.setMeta("version", COMAP_VERSION); !stored) return stored.error();
  return all;
}

}  // namespace comap
