#include "tests/reference/camera_reference.h"

#include <algorithm>
#include <cmath>

namespace comap::reference {

View::View(const CameraModel& camera_model, const Pose& T_map_cam, const FusionParameters& p)
    : camera(camera_model), parameters(p) {
  const Pose T_cam_map = T_map_cam.inverse();
  R_cam_map = T_cam_map.rotationMatrix().cast<float>();
  t_cam_map = T_cam_map.translation().cast<float>();
}

Eigen::Vector2f View::project(const Eigen::Vector3f& x) const { return camera.project(x.cast<double>()).cast<float>(); }

Eigen::Vector3f View::ray(float u, float v) const { return camera.unproject(u, v, 1).cast<float>(); }

float View::focal() const { return static_cast<float>((std::abs(camera.fx) + std::abs(camera.fy)) / 2); }

float View::sigma(float z) const { return parameters.noise_floor_m + parameters.noise_factor_per_m * z * z; }

float View::gate(float z) const { return std::clamp(3 * sigma(z), 0.01f, 0.05f); }

}  // namespace comap::reference
