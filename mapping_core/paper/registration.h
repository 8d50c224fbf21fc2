// Dense registration of one view to another, judged by the paper's own numbers.
#pragma once

#include <optional>

#include "mapping_core/paper/paper_options.h"
#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/rotation_alignment.h"

namespace comap {

/// Levels of the pyramids that whole views are aligned with.
inline constexpr int kDenseLevels = 3;
/// The one level of fern images: an eighth of the view's size.
inline constexpr int kSmallLevel = 3;

/// How well two views lie on each other, point to plane.
struct Fit {
  size_t inliers = 0;         ///< pixels whose surfaces are within 10 cm and 20 degrees
  size_t compared = 0;        ///< pixels with depth in both
  double rms_m = 0;           ///< of inliers
  double error = 1;           ///< sqrt(sum r^2) / inliers, metres: looser the more inliers there are
  double worst_variance = 1;  ///< largest diagonal entry of the inverse of 100 sum J^T J + that of brightness
};

/// Of level `level` of two pyramids, over all pixels of the frame's. `brightness` is what brightness adds to the normal
/// matrix.
Fit fitOf(const Pyramid& reference, const Pyramid& frame, size_t level, const Pose& T_ref_cur,
          const Matrix6d& brightness = Matrix6d::Zero());

/// One view on another, and how well it lies there.
struct RegisteredView {
  Pose T_ref_cur;
  Fit fit;
};

/// Whether a fit passes; gates are scaled to the number of pixels.
bool passes(const Fit& fit, const ClosureGates& gates, const CameraModel& camera, bool independent);

/// Thread rule: one thread.
class Registrar {
 public:
  explicit Registrar(const PaperOptions& options);

  /// kDenseLevels levels of geometry and brightness, all pixels of the reference.
  Alignment align(const Pyramid& reference, const Pyramid& frame, const Pose& T_guess);
  /// The same from where both views are taken to be, judged; nothing if too little is in both.
  std::optional<RegisteredView> registerViews(const Pyramid& reference, const Pyramid& frame);
  /// Geometry alone on kSmallLevel alone, as fern images are aligned.
  Alignment alignSmall(const Pyramid& reference, const Pyramid& frame);
  /// How the camera has turned between two pictures, from their coarse grey levels; no turn if they do not tell.
  Pose turn(const Pyramid& previous, const Pyramid& current);

 private:
  Matrix6d brightnessMatrix(const Pyramid& frame, const Alignment& aligned);

  const bool joint_covariance_;
  AlignmentOptions options_, small_options_;
  DepthNoiseModel noise_;
  PointResiduals workspace_;
  RotationWorkspace rotation_workspace_;
  ReferenceView reference_;
  std::vector<PickedPoint> picked_;
};

}  // namespace comap
