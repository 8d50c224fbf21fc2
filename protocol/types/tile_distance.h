// Where a tile lies in its map.
#pragma once

#include <Eigen/Core>

#include "protocol/types/tile.h"

namespace comap {

/// Its corner of lowest coordinates, metres.
inline Eigen::Vector3d cornerOf(const TileKey& key) {
  return Eigen::Vector3d(key.x, key.y, key.z) * double{kTileEdge_m};
}

/// From `position_m` to the nearest point of the tile's cube; 0 within it.
inline double distanceToTile(const TileKey& key, const Eigen::Vector3d& position_m) {
  const Eigen::Vector3d corner = cornerOf(key);
  const Eigen::Vector3d nearest =
      position_m.cwiseMax(corner).cwiseMin(corner + Eigen::Vector3d::Constant(double{kTileEdge_m}));
  return (nearest - position_m).norm();
}

}  // namespace comap
