// The normal of the surface around a pixel of a pyramid level.
#pragma once

#include <Eigen/Core>

#include "mapping_core/rgbd/pyramid.h"

namespace comap {

/// Pixels to each side that a normal is taken over at pyramid level `level`: about the same piece of surface at every
/// level, 4 pixels of full resolution to each side.
int normalReach(int level);

/// Point of a pixel in the level's camera frame, metres.
Eigen::Vector3f pointAt(const PyramidLevel& level, int x, int y);

/// Unit normal towards the camera by central differences over `reach` pixels; zero where a neighbour is missing or
/// beyond a jump, at the image's border, or where the surface is seen at a grazing angle.
Eigen::Vector3f normalAt(const PyramidLevel& level, int x, int y, int reach);

}  // namespace comap
