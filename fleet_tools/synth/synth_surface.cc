#include "fleet_tools/synth/synth_surface.h"

#include <cmath>

#include "fleet_tools/synth/synth_random.h"

namespace comap {

bool SurfaceCollector::insert(uint64_t key) {
  if (2 * used_ >= slots_.size()) {
    std::vector<uint64_t> old(2 * slots_.size(), kEmpty);
    old.swap(slots_);
    used_ = 0;
    for (const uint64_t known : old) {
      if (known != kEmpty) insert(known);
    }
  }
  const size_t mask = slots_.size() - 1;
  size_t slot = mixBits(key) & mask;
  while (slots_[slot] != kEmpty && slots_[slot] != key) slot = (slot + 1) & mask;
  if (slots_[slot] == key) return false;
  slots_[slot] = key;
  ++used_;
  return true;
}

void SurfaceCollector::add(const SynthView& view, const CameraModel& camera, const Pose& T_world_cam,
                           const SynthRenderer& renderer, int frame) {
  const Eigen::Matrix3f R_world_cam = T_world_cam.rotationMatrix().cast<float>();
  const Eigen::Vector3f origin = T_world_cam.translation().cast<float>();
  const float fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const float cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  constexpr int kBias = 1 << 20;
  for (int y = (frame / 2) % 2; y < camera.height; y += 2) {
    for (int x = frame % 2; x < camera.width; x += 2) {
      const float z = view.depth_m.at(x, y);
      if (z <= 0 || z > kFarthest_m) continue;
      const Eigen::Vector3f ray((static_cast<float>(x) - cx) / fx, (static_cast<float>(y) - cy) / fy, 1);
      const Eigen::Vector3f point = origin + z * (R_world_cam * ray);
      const auto cell = [&](int axis) {
        return static_cast<uint64_t>(static_cast<int>(std::floor(point[axis] / kVoxel_m)) + kBias) & 0x1fffff;
      };
      if (!insert(cell(0) << 42 | cell(1) << 21 | cell(2))) continue;
      points_.positions.push_back(point);
      points_.normals.push_back(renderer.normalAt(view.primitive.at(x, y), point));
    }
  }
}

}  // namespace comap
