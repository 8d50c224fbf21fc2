// What programs on the robot are told, as it was at one moment.
#pragma once

#include <memory>
#include <vector>

#include "protocol/types/tile.h"
#include "robot_api/wire.h"

namespace comap {

/// The tiles that the robot held at one time.
struct TileSnapshot {
  uint64_t number = 0;  ///< grows with each change
  MapId map;
  std::vector<std::shared_ptr<const Tile>> tiles;
};

struct ApiState {
  robot_api::PoseNews pose;                   ///< sequence 0: none yet
  std::shared_ptr<const TileSnapshot> tiles;  ///< never null once published
};

}  // namespace comap
