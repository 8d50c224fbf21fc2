// Where is a robot that has lost its way? It compares what it sees with the places that it remembers, and believes only
// what passes several independent checks: a wrong place is worse than none.
#pragma once

#include <cstdint>
#include <string>

#include "edge_agent/odometry/place_memory.h"
#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/rgbd/rotation_alignment.h"

namespace comap {

/// Thresholds; none depends on the number of points.
struct RelocaliserOptions {
  size_t capacity = 500;  ///< keyframes remembered
  size_t candidates = 5;  ///< places tried, the most similar first
  double max_dissimilarity = 0.45;
  double seed_rad = 0.175;            ///< yaw and pitch of the extra starting poses
  double coarse_inlier_ratio = 0.30;  ///< below it the full alignment is not worth its time
  double inlier_ratio = 0.80;
  double overlap = 0.35;  ///< share of the remembered points that the frame sees and agrees with
  double rms_sigma = 1.5;
  double degeneracy = 2e-3;
  double photometric_median = 14;  ///< grey levels
  double seen_through = 0.05;      ///< share of pixels, either way
  double agree = 0.6;              ///< share of pixels at the same depth, both ways
  double gate_m = 0.05;            ///< how far apart surfaces are different ones
  double round_trip_m = 0.02, round_trip_rad = 0.0175;
  /// Two places that are both accepted but say this much different poses: neither is believed.
  double ambiguous_m = 0.5, ambiguous_rad = 0.26;
  DepthNoiseModel noise;
};

/// The best match and its numbers. Not accepted: those of the most promising place, as far as it came.
struct Relocalisation {
  bool accepted = false;
  std::string reason;  ///< "accepted", or the check that refused
  uint32_t sequence = 0;
  Pose T_odom_keyframe;  ///< as it was remembered
  Pose T_keyframe_cam;   ///< the live camera in the remembered keyframe
  double dissimilarity = 1, inlier_ratio = 0, overlap = 0, rms_sigma = 0, degeneracy = 0, photometric_median = 255;
  double seen_through = 1, agree = 0, round_trip_m = 0, round_trip_rad = 0;
};

/// Thread rule: one thread (it keeps buffers).
class Relocaliser {
 public:
  explicit Relocaliser(const RelocaliserOptions& options) : options_(options), memory_(options.capacity) {}

  /// Remembers a keyframe; see PlaceMemory::add.
  bool add(uint32_t sequence, const Pose& T_odom_keyframe, const FernCode& code, const Pyramid& pyramid) {
    return memory_.add(sequence, T_odom_keyframe, code, pyramid);
  }

  /// Finds the place that `live` (levels kPlaceLevel and kPlaceLevel + 1 count) with its code shows. Reasons of
  /// refusal: too_few_levels, no_similar_place, coarse_alignment, too_few_points, inlier_ratio, overlap, rms_sigma,
  /// degenerate, photometric, seen_through, depth_disagrees, round_trip, ambiguous.
  Relocalisation relocalise(const Pyramid& live, const FernCode& code);

  const PlaceMemory& memory() const { return memory_; }
  void clear() { memory_.clear(); }

 private:
  Relocalisation judge(const RememberedPlace& place, const Pyramid& live, const ReferenceView& live_reference);

  RelocaliserOptions options_;
  PlaceMemory memory_;
  PointResiduals workspace_;
  RotationWorkspace rotation_workspace_;
};

}  // namespace comap
