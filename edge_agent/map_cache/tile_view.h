// The cached map as a camera would see it, drawn by the processor: what a live frame is registered against.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "edge_agent/map_cache/tile_cache.h"
#include "protocol/types/image.h"
#include "protocol/types/pose.h"

namespace comap {

struct TileViewOptions {
  float depth_min_m = 0.25f, depth_max_m = 6.0f;
  /// Surfels of tiles are thinned out; discs at least this large close the gaps between them.
  float disc_radius_m = 0.009f;
  float blend_m = 0.03f;  ///< surfaces at one pixel that lie no farther apart are one, and averaged
};

struct TileView {
  CameraModel camera;
  Image<float> depth_m;  ///< along the optical axis, 0 = none
  ColourImage colour;    ///< where there is no depth that of the surfaces around, so that no edge is where the map ends
  size_t surfels = 0;    ///< that were drawn
  double filled = 0;     ///< share of the pixels
};

/// Draws views of tiles, each surfel as a disc seen from its front side. The same tiles give the same bits on every
/// processor. Thread rule: one thread (it keeps buffers).
class TileRenderer {
 public:
  explicit TileRenderer(const TileViewOptions& options) : options_(options) {}

  /// The tiles as seen from T_map_cam. Valid until the next call.
  const TileView& render(const TileCache& cache, const CameraModel& camera, const Pose& T_map_cam);

 private:
  struct Sum {
    float weight = 0, depth = 0, r = 0, g = 0, b = 0;
  };
  void draw(const Tile& tile, const Eigen::Matrix3f& R_cam_map, const Eigen::Vector3f& t_cam_map);

  void fillGaps();

  TileViewOptions options_;
  TileView view_;
  Image<Sum> sums_;
  std::vector<Image<Sum>> halved_;
};

}  // namespace comap
