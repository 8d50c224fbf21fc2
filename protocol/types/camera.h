// Pinhole camera. Pixel (i, j) has its centre at the continuous coordinate (i, j); x right, y down, z forward.
#pragma once

#include <Eigen/Core>

namespace comap {

struct CameraModel {
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  int width = 0, height = 0;              ///< pixels

  Eigen::Vector2d project(const Eigen::Vector3d& x_cam) const {
    return {fx * x_cam.x() / x_cam.z() + cx, fy * x_cam.y() / x_cam.z() + cy};
  }
  Eigen::Vector3d unproject(double u, double v, double z) const { return {(u - cx) / fx * z, (v - cy) / fy * z, z}; }

  /// The camera of an image shrunk by `factor` in both directions by averaging factor x factor blocks.
  CameraModel shrunk(int factor) const {
    return {fx / factor,
            fy / factor,
            (cx + 0.5) / factor - 0.5,
            (cy + 0.5) / factor - 0.5,
            width / factor,
            height / factor};
  }
  bool operator==(const CameraModel&) const = default;
};

}  // namespace comap
