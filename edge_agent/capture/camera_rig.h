// What is known of a camera's two eyes: lenses, where they stand to each other, what depth values mean.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "protocol/types/camera.h"
#include "protocol/types/pose.h"

namespace comap {

/// Pinhole with Brown-Conrady distortion: with (x, y) the ray at z = 1 and r^2 = x^2 + y^2,
///   x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
///   y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y
/// and the pixel at (fx x' + cx, fy y' + cy). The order of coefficients that OpenCV and ROS write is k1 k2 p1 p2 k3.
struct Lens {
  CameraModel pinhole;  ///< of the size the device delivers; fx = 0: not known
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  bool straight() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
  /// The pixel that sees the ray (x, y, 1).
  Eigen::Vector2d pixelOf(double x, double y) const;
  /// The ray (x, y, 1) that the pixel sees, to 1e-9; nothing where the distortion cannot be undone.
  std::optional<Eigen::Vector2d> rayOf(double u, double v) const;
  bool operator==(const Lens&) const = default;
};

struct CameraRig {
  Lens colour, depth;
  Pose T_colour_depth;
  double depth_units_per_m = 1000;
};

/// What a kind of camera is like when nobody has calibrated it: a start, a few pixels wrong for any one device.
struct CameraProfile {
  std::string name;
  CameraRig rig;
  float noise_floor_m = 0, noise_factor_per_m = 0;  ///< sigma = floor + factor * z^2
};

/// The profiles built in.
const std::vector<CameraProfile>& cameraProfiles();

/// The lens for pictures of another size of the same proportions; nothing for others.
std::optional<Lens> resized(const Lens& lens, int width, int height);

}  // namespace comap
