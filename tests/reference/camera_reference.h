// Scalar oracle: camera, noise model and the surfel as the kernels hold it. Metres; single precision as on the device.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mapping_core/surfels/surfel_map.h"

namespace comap::reference {

struct Row {
  Eigen::Vector3f position, normal;
  float confidence = 0;  ///< negative: removed
  float radius = 0;
  Eigen::Vector3f colour = Eigen::Vector3f::Zero();  ///< 0..255 with fractions
  uint32_t owner = 0, contributors = 0, observations = 0;
  float precision = 0;
  uint32_t misses = 0, violations = 0;
};

struct View {
  CameraModel camera;
  Eigen::Matrix3f R_cam_map;
  Eigen::Vector3f t_cam_map;
  FusionParameters parameters;

  View(const CameraModel& camera, const Pose& T_map_cam, const FusionParameters& parameters);
  Eigen::Vector3f toCamera(const Eigen::Vector3f& x_map) const { return R_cam_map * x_map + t_cam_map; }
  Eigen::Vector3f toMap(const Eigen::Vector3f& x_cam) const { return R_cam_map.transpose() * (x_cam - t_cam_map); }
  Eigen::Vector2f project(const Eigen::Vector3f& x_cam) const;
  Eigen::Vector3f ray(float u, float v) const;  ///< z = 1
  float focal() const;
  float sigma(float z) const;
  float gate(float z) const;
};

}  // namespace comap::reference
