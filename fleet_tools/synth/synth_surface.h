// The exact surface that cameras have seen, as points.
#pragma once

#include <vector>

#include "fleet_tools/export/ply.h"
#include "fleet_tools/synth/synth_renderer.h"

namespace comap {

/// Keeps one exact point, the first seen, per cube of 15 mm, of what lies within 4.5 m of depth.
class SurfaceCollector {
 public:
  static constexpr float kVoxel_m = 0.015f;
  static constexpr float kFarthest_m = 4.5f;

  /// Takes a quarter of the view's pixels, another quarter each time `frame` moves on by one.
  void add(const SynthView& view, const CameraModel& camera, const Pose& T_world_cam, const SynthRenderer& renderer,
           int frame);

  const PlyPoints& points() const { return points_; }

 private:
  bool insert(uint64_t key);

  std::vector<uint64_t> slots_ = std::vector<uint64_t>(1 << 16, kEmpty);
  size_t used_ = 0;
  PlyPoints points_;
  static constexpr uint64_t kEmpty = ~uint64_t{0};
};

}  // namespace comap
