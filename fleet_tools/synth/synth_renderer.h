// Exact pictures of a scene from a pose.
#pragma once

#include <memory>

#include "fleet_tools/synth/scene.h"
#include "fleet_tools/synth/scene_light.h"
#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

struct SynthView {
  ColourImage colour;
  Image<float> depth_m;      ///< z of the ray through the pixel's centre; 0 = nothing there
  Image<float> cosine;       ///< between that ray and the surface's normal, 0..1
  Image<int32_t> primitive;  ///< index into the scene's, -1 = none
};

class SynthRenderer {
 public:
  /// Draws the textures and computes the light of the scene, which must outlive this: a second or two.
  SynthRenderer(const Scene& scene, int threads);

  /// One view; the same for every number of threads.
  SynthView render(const CameraModel& camera, const Pose& T_world_cam) const;

  /// Outward unit normal of the primitive at a point on its surface, both in the world.
  Eigen::Vector3f normalAt(int primitive, const Eigen::Vector3f& point) const;

 private:
  struct Projected;
  struct Rays;
  void traceTile(const Rays& rays, const std::vector<Projected>& projected, int tile, SynthView& view) const;
  void shadeRow(const Rays& rays, int y, SynthView& view) const;
  Eigen::Vector3f shade(int primitive, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float depth_m,
                        float pixel, float* cosine) const;

  const Scene& scene_;
  int threads_;
  std::vector<Texture> textures_;
  LightMap light_;
};

}  // namespace comap
