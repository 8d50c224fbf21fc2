// Where a camera stands, and in which map.
#pragma once

#include "protocol/types/ids.h"
#include "protocol/types/pose.h"

namespace comap {

struct MapPose {
  MapId map;
  Pose T_map_cam;
};

}  // namespace comap
