// Faces of solids and coordinates on them.
#pragma once

#include <Eigen/Core>

#include "fleet_tools/synth/scene.h"

namespace comap {

/// A place on a solid. Faces: of a box -x +x -y +y -z +z, of a cylinder side, top, bottom, of an ellipsoid one.
struct SurfaceSpot {
  int face = 0;
  float a = 0, b = 0;            ///< 0..1 across the face
  float size_a = 1, size_b = 1;  ///< metres across the face
  Eigen::Vector3f normal_local = Eigen::Vector3f::UnitZ();
};

int faceCount(Shape shape);

/// The spot at a point on the surface, given in local coordinates.
SurfaceSpot spotAt(const Primitive& primitive, const Eigen::Vector3f& local);

/// The inverse: local coordinates of (a, b) on a face, and the outward unit normal there.
Eigen::Vector3f pointOf(const Primitive& primitive, int face, float a, float b, Eigen::Vector3f& normal_local);

/// Metres across a face.
Eigen::Vector2f sizeOf(const Primitive& primitive, int face);

/// Smallest t > 0 at which origin + t * direction (local coordinates) enters the solid, or infinity. Rays that start
/// inside do not enter.
float enter(Shape shape, const Eigen::Vector3f& half, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction);

}  // namespace comap
