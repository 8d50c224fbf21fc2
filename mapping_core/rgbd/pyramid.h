// Grey and depth images of one frame, halved level by level.
#pragma once

#include <vector>

#include "protocol/types/image.h"

namespace comap {

class RowWorkers;

struct PyramidLevel {
  CameraModel camera;
  Image<float> grey;     ///< 0..255
  Image<float> depth_m;  ///< along the optical axis, 0 = none
};

/// Level 0 has the frame's size, each further one half of it in both directions.
using Pyramid = std::vector<PyramidLevel>;

/// Fills `pyramid` from an RGB-D pair, reusing its memory. Grey: 2x2 means. Depth: mean of those of 2x2 that lie
/// within the jump gate of the nearest one, so that edges stay edges; nearer than min or farther than max: none.
/// Rows are shared among `workers` if there are any; the result is the same.
void buildPyramid(const ColourImage& colour, const DepthImage& depth, const CameraModel& camera, int levels,
                  float depth_min_m, float depth_max_m, Pyramid& pyramid, RowWorkers* workers = nullptr);

/// The same from depth in metres, as predictions come.
void buildPyramid(const ColourImage& colour, const Image<float>& depth_m, const CameraModel& camera, int levels,
                  Pyramid& pyramid);

/// Makes the depth of all coarser levels anew from that of level 0.
void shrinkDepth(Pyramid& pyramid, RowWorkers* workers = nullptr);

}  // namespace comap
