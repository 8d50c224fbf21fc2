// Direct RGB-D alignment of a frame to a reference view: noise-scaled point-to-plane plus photometric residuals with
// robust weights, coarse to fine.
#pragma once

#include <vector>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/point_residuals.h"
#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "protocol/types/pose.h"

namespace comap {

struct AlignmentOptions {
  /// Iterations at the coarsest level of the reference, the next finer one, and so on; the last entry serves the rest.
  std::vector<int> iterations = {8, 6, 6};
  float distance_gate_m = 0.10f;  ///< association gate at the finest level
  float coarse_gate_m = 0.20f;    ///< and at the coarsest
  /// Added to sigma at the coarsest level, nothing at the finest: lets the robust weights pull from afar when the guess
  /// is poor. Residual statistics of the finest level are not touched.
  float coarse_extra_sigma_m = 0;
  float extra_sigma_m = 0;  ///< the same at every level; beside a model of no noise, all depth residuals weigh alike
  /// Brightness is compared where depths agree within this; 0: within 3 cm or 4 sigma, whichever is more.
  float photometric_gate_m = 0;
  float photometric_weight = 0.28f;  ///< grey residuals are correlated, depth ones less so
  float information_deflation = 50;  ///< neighbouring pixels are not independent
  double stop_m = 2e-5, stop_rad = 2e-5;
  double weak_ratio = 6e-4;  ///< directions with less than this share of the strongest are free: they keep the guess
  double free_sigma = 0.1;   ///< how well the guess is known there: radians, or metres a metre of depth
  DepthNoiseModel noise;
};

/// How one alignment ended. All quality numbers are independent of the number of points.
struct Alignment {
  Pose T_ref_cur;
  Matrix6d information = Matrix6d::Zero();  ///< of T_ref_cur for the left increment, deflated; in free directions the
                                            ///< guess's
  double inlier_ratio = 0;                  ///< geometric inliers / reference points that project into the frame
  double overlap = 0;                       ///< reference points that project into the frame / all
  double rms_sigma = 1e9;                   ///< of geometric inliers, in sigma
  double degeneracy = 0;  ///< how well the weakest direction is determined, as share of the strongest (constraints.h),
                          ///< translation in units of the mean depth
  Vector6d weakest_direction = Vector6d::Zero();  ///< with translation in units of the mean depth
  int free_directions = 0;                        ///< not determined by the data: there T_ref_cur is the guess
  double photometric_median = 255;                ///< grey levels after gain and bias
  double gain = 1, bias = 0;                      ///< grey_cur = gain grey_ref + bias
  int iterations = 0;
  bool solved = false;  ///< false: too few points to solve at all
};

/// Aligns `frame` (a pyramid that has the reference's levels) starting from T_guess = T_ref_cur.
/// `workspace` is memory only, so that nothing is allocated per frame.
Alignment align(const ReferenceView& reference, const Pyramid& frame, const Pose& T_guess,
                const AlignmentOptions& options, PointResiduals& workspace);

}  // namespace comap
