// What a frame is aligned to: a sparse, informative set of points of a keyframe or of a predicted view, per level.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"

namespace comap {

class RowWorkers;

struct ReferenceOptions {
  int finest_level = 1;
  int coarsest_level = 3;
  int max_points = 6000;  ///< a level; one per cell of a grid over the image
};

/// Structure of arrays, all of one length; padded to a multiple of 8 with points that never count.
struct ReferencePoints {
  CameraModel camera;
  int level = 0;
  size_t count = 0;                  ///< without padding
  float median_gradient_square = 0;  ///< half of the points have less
  std::vector<float> x, y, z;        ///< in the reference camera's frame, metres
  std::vector<float> nx, ny, nz;     ///< unit normal towards the camera; 0 0 0 = none
  std::vector<float> grey;
  std::vector<float> gx, gy;   ///< gradient of grey, levels a pixel
  std::vector<float> sigma_m;  ///< 1 sigma of depth noise along the normal
};

struct ReferenceView {
  std::vector<ReferencePoints> levels;  ///< coarsest first
};

/// The point of one cell of the grid; z = 0: the cell has none.
struct PickedPoint {
  Eigen::Vector3f p = Eigen::Vector3f::Zero(), n = Eigen::Vector3f::Zero();
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
  float grey = 0, sigma_m = 0;
};

/// Picks per grid cell the pixel with the strongest grey gradient among those with depth, and gives it the normal of
/// its neighbourhood if that is smooth. Deterministic.
ReferenceView buildReference(const Pyramid& pyramid, const ReferenceOptions& options, const DepthNoiseModel& noise);

/// The same into the memory of an earlier one; `workspace` is memory only. Rows are shared among `workers`.
void buildReference(const Pyramid& pyramid, const ReferenceOptions& options, const DepthNoiseModel& noise,
                    RowWorkers* workers, std::vector<PickedPoint>& workspace, ReferenceView& view);

}  // namespace comap
