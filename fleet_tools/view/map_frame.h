// How a map is best looked at: which way is up, how high and how wide it is.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "protocol/types/pose.h"
#include "protocol/types/tile.h"

namespace comap {

struct MapFrame {
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  ///< unit, in the map's frame
  double low_m = 0, high_m = 0;                    ///< along `up`, without outliers: the floor, the ceiling
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = 1;  ///< from the centre to nearly all surfels, and to every camera
};

/// Looks at a sample of the surfels; without any, at where the cameras were.
MapFrame mapFrame(std::span<const Tile* const> tiles, std::span<const Pose> T_map_cams);

}  // namespace comap
