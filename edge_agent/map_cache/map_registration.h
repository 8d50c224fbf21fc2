// Where in the cached map does a frame stand? The map is drawn from where the camera is believed to be, and the frame
// is aligned to that picture.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "edge_agent/map_cache/tile_view.h"
#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/appearance.h"
#include "mapping_core/rgbd/rotation_alignment.h"

namespace comap {

/// Thresholds; none depends on the number of points.
struct RegistrationOptions {
  TileViewOptions view;
  DepthNoiseModel noise;
  double filled = 0.15;  ///< share of the picture that the map must fill
  // Near where the camera is believed to be.
  double inlier_ratio = 0.7;
  double overlap = 0.2;  ///< share of the map's view that the frame sees and agrees with
  double rms_sigma = 1.5;
  double photometric_median = 20;  ///< grey levels
  double jump_m = 0.25, jump_rad = 0.2;
  // For a camera that may be anywhere.
  double seed_rad = 0.175;  ///< yaw and pitch of the extra starting poses
  double coarse_inlier_ratio = 0.30;
  double place_inlier_ratio = 0.85;
  double place_overlap = 0.35;
  double place_rms_sigma = 1.5;
  double place_photometric_median = 18;
  double degeneracy = 2e-3;
  double seen_through = 0.05, agree = 0.6;  ///< shares of pixels, either way
  double gate_m = 0.05;                     ///< how far apart surfaces are different ones
  double unlike = 0.2, features = 0.15;     ///< shares of patches, see appearance.h
  double round_trip_m = 0.02, round_trip_rad = 0.0175;
};

/// How one registration ended. If it was refused, the numbers are as far as it came.
struct Registration {
  bool accepted = false;
  std::string reason;  ///< "accepted", or the check that refused
  Pose T_map_cam;
  Matrix6d information = Matrix6d::Zero();  ///< of T_map_cam for an increment at the camera: T_map_cam exp(xi)
  double inlier_ratio = 0, overlap = 0, rms_sigma = 0, degeneracy = 0, photometric_median = 255;
  double seen_through = 1, agree = 0, unlike = 0, features = 0, round_trip_m = 0, round_trip_rad = 0;
};

/// Thread rule: one thread (it keeps buffers).
class MapRegistration {
 public:
  explicit MapRegistration(const RegistrationOptions& options) : options_(options), renderer_(options.view) {}

  /// A camera that stands near T_map_guess. `live` needs 4 levels or more. Reasons of refusal: too_few_levels,
  /// unmapped, too_few_points, inlier_ratio, overlap, rms_sigma, photometric, jump.
  Registration near(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess);

  /// A camera that may stand near T_map_guess, or anywhere else: all that tells places apart is asked. Besides the
  /// reasons above: coarse_alignment, degenerate, seen_through, depth_disagrees, unlike, featureless, round_trip.
  Registration anywhere(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess);

  /// The gates of anywhere() from a pose that is good to some centimetres.
  Registration verify(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess);

 private:
  bool predict(const TileCache& cache, const Pyramid& live, const Pose& T_map_cam);

  RegistrationOptions options_;
  TileRenderer renderer_;
  Pyramid predicted_;
  ReferenceView reference_, live_reference_;
  std::vector<PickedPoint> picked_;
  PointResiduals workspace_;
  RotationWorkspace rotation_workspace_;
};

}  // namespace comap
