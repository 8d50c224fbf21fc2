// A predicted view whose holes are filled with what the camera saw from there.
#pragma once

#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

struct FilledView {
  ColourImage colour;        ///< predicted, where nothing is predicted live
  Image<float> depth_m;      ///< the same
  Image<float> predicted_m;  ///< depth of predicted pixels only
  double dense_share = 0;    ///< of pixels that are predicted
};

/// `frame` was taken from the pose of `view`; its depth beyond `depth_max_m` is left out.
FilledView fillView(PredictedView view, const Frame& frame, float depth_min_m, float depth_max_m);

/// The filled view as depth in the units of frames.
DepthImage depthUnits(const Image<float>& depth_m);

}  // namespace comap
