// A keyframe at an eighth of its size: small enough to keep for all keyframes, good enough to tell what two of them
// say about each other's surfaces.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/keyframe.h"

namespace comap {

struct Sketch {
  KeyframeId id;
  CameraModel camera;
  Image<float> depth_m;    ///< along the optical axis, 0 = none or beside an edge, where it is of no surface
  Image<float> nearest_m;  ///< the nearest raw depth of 3x3 cells, 0 = none
  ColourImage colour;      ///< means of 8x8 pixels
};

/// `pyramid` is the keyframe's own, with levels 0..3 at least.
Sketch makeSketch(const Keyframe& keyframe, const Pyramid& pyramid, const DepthNoiseModel& noise);

struct ComparisonOptions {
  double gate_m = 0.05;      ///< surfaces nearer to each other than this (or 3 sigma) are one
  float colour_levels = 24;  ///< after gain and bias, outside of what 3x3 cells show: another colour
  DepthNoiseModel noise;
};

/// What `seen` says about the surfaces of `surfaces`; counts of cells.
struct Comparison {
  size_t cells = 0;        ///< of `surfaces` that have depth
  size_t visible = 0;      ///< that fall on a cell of `seen` with depth
  size_t agree = 0;        ///< and are the same surface there
  size_t through = 0;      ///< `seen` looks through where the surface should be
  size_t compared = 0;     ///< agreeing ones whose colour could be compared
  size_t discoloured = 0;  ///< and is another
};

/// Cells of `surfaces` seen from `seen`, whose camera stands at T_surfaces_seen.
Comparison compareSketches(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                           const ComparisonOptions& options);

/// Of the cells of `surfaces` that have depth the share that agrees, as compareSketches() counts them; colours are not
/// looked at, which is most of its work.
double agreedShare(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                   const ComparisonOptions& options);

}  // namespace comap
