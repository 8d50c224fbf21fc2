// Residuals and Jacobian rows of all reference points at one pose, and the normal equations they sum up to. The inner
// loops of alignment: vectorised for whatever the processor offers, chosen at run time; the bits do not depend on it.
#pragma once

#include <cstddef>
#include <vector>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "protocol/types/pose.h"

namespace comap {

/// grey_cur = gain grey_ref + bias.
struct Brightness {
  float gain = 1, bias = 0;
};

/// Per point: geometric residual (sigma), photometric residual (grey levels), their rows and weights. Weight 0 marks
/// points that do not count. Kept by the caller so that nothing is allocated per frame.
struct PointResiduals {
  std::vector<float> rg, wg, jg[6];
  std::vector<float> rp, wp, jp[6];
  std::vector<float> gradient;  ///< product of the gradients of both views there, grey levels a pixel squared
  void reserve(size_t points);
};

/// What limits an association.
struct AssociationGates {
  float distance_m = 0.1f;      ///< between point and measurement
  float extra_sigma_m = 0;      ///< added to the sigma of depth
  float photometric_sigma = 4;  ///< depth must agree within this, or 3 cm, for brightness to be compared
  float photometric_m = 0;      ///< if not 0, within this instead
  float tukey_sigma = 4.6f;     ///< beyond it a geometric residual has no weight
};

struct ResidualCounts {
  size_t visible = 0;      ///< points that project into the frame
  size_t compared = 0;     ///< and have a normal, and depth there
  size_t inliers = 0;      ///< and geometric weight
  size_t photometric = 0;  ///< and a brightness to compare
  double inlier_square_sum = 0, depth_sum = 0;
};

/// Evaluates `points` in `frame` (the level they belong to). Geometric weights are Tukey's; photometric ones 1 or 0.
ResidualCounts evaluateResiduals(const ReferencePoints& points, const PyramidLevel& frame, const Pose& T_ref_cur,
                                 const AssociationGates& gates, const Brightness& brightness,
                                 const DepthNoiseModel& noise, PointResiduals& out);

struct PhotometricWeights {
  float scale = 3;       ///< of residuals, grey levels
  float huber = 1.345f;  ///< scales beyond which the weight falls off
  float weight = 1;      ///< of all
  /// A gradient that both views share must exceed this (its square, grey levels a pixel squared), else it is noise:
  /// the weight grows from 0 there to 1 far above.
  float least_gradient_square = 0;
};

/// Replaces photometric weights by Huber's, weight / scale^2 at the centre.
void weighPhotometric(size_t points, const PhotometricWeights& weights, PointResiduals& residuals);

struct NormalEquations {
  Matrix6d a = Matrix6d::Zero();  ///< sum of w J^T J
  Vector6d b = Vector6d::Zero();  ///< sum of w J^T r
};

/// Sums over both kinds of residuals, in eight lanes whatever the vector width.
NormalEquations sumNormalEquations(size_t points, const PointResiduals& residuals);

}  // namespace comap
