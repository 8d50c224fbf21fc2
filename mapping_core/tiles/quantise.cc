// One surfel to 14 bytes and back.
#include <algorithm>
#include <cmath>

#include "mapping_core/tiles/tile_builder.h"
#include "protocol/types/tile_quantisation.h"

namespace comap {

TileSurfel quantise(const Surfel& surfel, const TileKey& key) {
  TileSurfel out;
  quantiseDisc({surfel.position, surfel.normal, surfel.radius}, key, out);
  out.r = surfel.colour.r;
  out.g = surfel.colour.g;
  out.b = surfel.colour.b;
  out.confidence = static_cast<uint8_t>(std::lround(std::clamp(surfel.confidence, 0.0f, 255.0f)));
  out.contributors = static_cast<uint8_t>(surfel.contributors & 0xff);
  return out;
}

Surfel dequantise(const TileSurfel& in, const TileKey& key) {
  const TileDisc disc = dequantiseDisc(in, key);
  Surfel out;
  out.position = disc.position;
  out.normal = disc.normal;
  out.radius = disc.radius_m;
  out.confidence = in.confidence;
  out.colour = {in.r, in.g, in.b};
  out.contributors = in.contributors;
  return out;
}

}  // namespace comap
