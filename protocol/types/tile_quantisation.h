// What the 14 bytes of a tile's surfel mean: metres and directions to steps and back.
#pragma once

#include <Eigen/Core>

#include "protocol/types/tile.h"

namespace comap {

/// The surface element that a tile's surfel stands for, in the map's frame.
struct TileDisc {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit
  float radius_m = 0;
};

/// Fills position, normal and radius of `to`; `disc` lies in the cube `key`, whose rim is where it is clamped to.
void quantiseDisc(const TileDisc& disc, const TileKey& key, TileSurfel& to);
/// Within 8 um, 1 degree of normal, 1.5 % of radius of what was quantised.
TileDisc dequantiseDisc(const TileSurfel& surfel, const TileKey& key);

}  // namespace comap
