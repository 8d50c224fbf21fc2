// What a camera can see, as boxes.
#pragma once

#include <Eigen/Geometry>

#include "mapping_core/surfels/push_constants.h"

namespace comap {

/// False only if no point of the box, or within a decimetre of it, is before the camera, nearer than `farthest` (m) and
/// at most `margin_px` outside the image.
bool mayBeInView(const Eigen::AlignedBox3f& box, const FramePush& frame, float farthest, float margin_px);

/// Holds all that the camera sees up to `farthest` (m), in the map's frame.
Eigen::AlignedBox3f viewBounds(const FramePush& frame, float farthest);

}  // namespace comap
