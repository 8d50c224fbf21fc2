#include "mapping_core/surfels/push_constants.h"

namespace comap {

FramePush framePush(const CameraModel& camera, const Pose& T_map_cam, const FusionParameters& parameters) {
  FramePush push;
  const Eigen::Matrix4d T_cam_map = T_map_cam.inverse().matrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) push.rows[4 * row + column] = static_cast<float>(T_cam_map(row, column));
  }
  push.fx = static_cast<float>(camera.fx);
  push.fy = static_cast<float>(camera.fy);
  push.cx = static_cast<float>(camera.cx);
  push.cy = static_cast<float>(camera.cy);
  push.width = static_cast<uint32_t>(camera.width);
  push.height = static_cast<uint32_t>(camera.height);
  push.noise_floor = parameters.noise_floor_m;
  push.noise_factor = parameters.noise_factor_per_m;
  return push;
}

}  // namespace comap
