// All numbers of the paper mode, in the paper's own (mostly ElasticFusion's) values, and the switches for what is ours.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Remedies for known defects of the method, and one variation. All off: the method as published, as far as
/// that is told.
struct PaperFixes {
  bool noise_weights = false;     ///< depth residuals weigh by the sensor's noise, robustly, instead of all alike
  bool brightness_gate = false;   ///< brightness is compared where depths agree to their noise instead of to 7 cm
  bool free_directions = false;   ///< a direction that nothing in view determines keeps the prediction
  bool check_tracking = false;    ///< a frame that does not fit the map is not fused
  bool per_camera_graph = false;  ///< each camera bends nodes of its own, and its loops freeze no one else's
  bool correct_pose_log = false;  ///< local loops bend the trajectory too, not only the map
  bool two_votes = false;         ///< maps are put together only when a second, distant match agrees
  /// The covariance that closures are judged by is of depth and brightness, as in the system the method builds on. Its
  /// limit is not published; with that system's, textured views pass where they lie wrong. So it is not the default.
  bool joint_covariance = false;
  bool independent_gates = false;  ///< closures are judged by rms and inlier ratio, not by rms / sqrt(N)
};

/// A remedy by its name on the command line.
struct PaperFix {
  const char* name;
  bool PaperFixes::*chosen;
  bool remedy = true;  ///< else a variation, which is no part of "all remedies"
};
inline constexpr PaperFix kPaperFixes[] = {{"noise-weights", &PaperFixes::noise_weights},
                                           {"brightness-gate", &PaperFixes::brightness_gate},
                                           {"free-directions", &PaperFixes::free_directions},
                                           {"check-tracking", &PaperFixes::check_tracking},
                                           {"per-camera-graph", &PaperFixes::per_camera_graph},
                                           {"correct-pose-log", &PaperFixes::correct_pose_log},
                                           {"two-votes", &PaperFixes::two_votes},
                                           {"joint-covariance", &PaperFixes::joint_covariance, false},
                                           {"independent-gates", &PaperFixes::independent_gates}};

/// What a registration must reach, for 640 x 480 pixels; other sizes are scaled.
struct ClosureGates {
  double error = 5e-5;  ///< sqrt(sum r^2) / N, metres
  double inliers = 35000;
  double variance = 1e-5;  ///< of each degree of freedom, from the unnormalised joint matrix with geometry times 100
};

/// What a registration minimises.
struct DenseOptions {
  double brightness_gate_m = 0.07;  ///< brightness is compared where depths agree within this
  /// Of a squared residual of brightness, in its robust scale, beside a squared metre of one of depth.
  double brightness_weight = 4e-5;
  double typical_depth_m = 2;  ///< where depth weighs the same whether all weigh alike or by the sensor's noise
};

struct FernOptions {
  uint64_t seed = FernBook::kStandardSeed;
  double harvest_dissimilarity = 0.3095;
  double match_dissimilarity = 0.7;  ///< similarity above 0.3
  uint32_t min_age = 300;            ///< ticks; of the camera's own places
  double error = 3e-4, inliers = 2400;
  double photometric = 115;  ///< mean of |dR| + |dG| + |dB|
  double least_drift_m = 0.06;
};

struct DeformationOptions {
  size_t stride = 5000;             ///< surfels to a node
  size_t global_share = 5;          ///< the global graph has every so-many-th node
  size_t most_nodes = 1024;         ///< the stride grows with larger maps
  double global_error_m = 3e-4;     ///< mean constraint error that a global deformation may leave
  double global_cost = 0.12;        ///< and its cost
  uint32_t pause_after_merge = 10;  ///< ticks without a global deformation
};

struct PaperOptions {
  FusionParameters fusion{
      .depth_min_m = 0.3f, .depth_max_m = 5.0f, .free_max_m = 5.0f, .stable_confidence = 10.0f, .unstable_timeout = 20};
  uint32_t active_window = 200;  ///< ticks
  double dense_share = 0.75;     ///< of the prediction; below it tracking uses the filled view
  double largest_step_m = 0.3;   ///< between frames; what moves farther keeps the old pose
  DenseOptions dense;
  ClosureGates closure;
  FernOptions ferns;
  DeformationOptions graph;
  PaperFixes fixes;
};

}  // namespace comap
