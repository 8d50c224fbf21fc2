// A small analytic world that renders exact RGB-D frames: truth for free, no data file.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

/// World axes as a camera's that looks along +z from the origin: x right, y down, z forward; metres.
class Scene {
 public:
  /// A room of 5 x 2.8 x 5 m around the origin with boxes and spheres in it; smooth texture that never repeats.
  /// `seed` picks the texture, so that two rooms of one shape can look different.
  static Scene room(uint64_t seed = 1);
  /// One infinite plane through `point` with normal `normal`, of one colour: no texture at all.
  static Scene plainPlane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, uint8_t grey = 128);

  /// A corridor along z without end: floor, ceiling and two walls, each of one colour. Nothing tells how far along.
  static Scene corridor();

  /// The same scene with one more box in it.
  Scene withBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) const;

  /// How far a point is from the nearest surface; metres.
  double distanceTo(const Eigen::Vector3d& x_world) const;

  /// The exact view from T_world_cam: colour of the point each pixel's centre sees, depth rounded to depth units.
  Frame render(const CameraModel& camera, const Pose& T_world_cam, int64_t stamp_ns = 0) const;

  /// Depth along the optical axis (metres, not rounded) at a continuous pixel; nothing if the ray hits nothing.
  std::optional<double> depthAt(const CameraModel& camera, const Pose& T_world_cam, double u, double v) const;

 private:
  enum class Shape : uint8_t { kRoom, kBox, kSphere, kPlane };
  struct Solid {
    Shape shape = Shape::kBox;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();       // a point of it, for planes
    Eigen::Vector3d half = Eigen::Vector3d::Ones();         // radius in x for spheres, the normal for planes
    Eigen::Vector3f grey = Eigen::Vector3f::Constant(112);  // mean r, g, b
  };
  struct Wave {
    Eigen::Vector3f k;     // radians a metre
    Eigen::Vector3f grey;  // amplitude of r, g, b
    float phase = 0;
  };
  struct Hit {
    double distance = 0;  // in units of the ray
    size_t solid = 0;
  };

  std::optional<Hit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;
  static std::optional<double> intersect(const Solid& solid, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray);
  Rgb colourAt(const Eigen::Vector3d& x_world, size_t solid) const;
  Rgb meanColour(const CameraModel& camera, const Pose& T_world_cam, int x, int y) const;

  std::vector<Solid> solids_;
  std::vector<Wave> waves_;
  int colour_samples_ = 1;  // a side, within a pixel
};

/// 640x480, f = 525, as the common structured-light cameras.
CameraModel kinectCamera();
/// The same field of view in 320x240, for tests that need many frames.
CameraModel smallCamera();

}  // namespace comap
