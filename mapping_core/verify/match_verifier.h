// Is this the same place? Coarse alignment from several seeds; a look at the candidate's own picture, which most wrong
// candidates do not pass; then full alignment to the view predicted from the candidate's map, both ways, and gates that
// do not depend on the number of pixels.
#pragma once

#include <optional>

#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/surfels/surfel_map.h"
#include "mapping_core/verify/keyframe_view.h"
#include "protocol/types/messages.h"

namespace comap {

struct VerifierOptions {
  float depth_max_m = 6.0f;
  double coarse_inlier_ratio = 0.30;  ///< below it the full stage is not worth its time
  double inlier_ratio = 0.85;         ///< inliers / compared: what one sees, the other must see as well
  double overlap = 0.35;              ///< share of the predicted surface that the query sees and agrees with
  double rms_sigma = 1.5;
  double degeneracy = 2e-3;
  double photometric_median = 18;  ///< grey levels
  double seen_through = 0.05;      ///< share of pixels
  double unlike = 0.2;             ///< share of textured patches
  double features = 0.15;          ///< share of patches
  double behind_m = 0.05;          ///< how far behind the map's surface counts as seen through
  double round_trip_m = 0.02, round_trip_rad = 0.0175;
  double seed_rad = 0.2;  ///< yaw and pitch of the extra seeds
  DepthNoiseModel noise;
};

/// Thread rule: one thread (it keeps buffers).
class MatchVerifier {
 public:
  explicit MatchVerifier(const VerifierOptions& options) : options_(options) {}

  /// Verifies that `query` sees what `candidate` saw. `map` is the surfel map that holds the candidate, which stands
  /// at T_map_candidate in it. Every outcome is a verdict; an error is only a failing device. `T_candidate_believed`,
  /// if given, is one more pose of the query to start from; what it ends at passes the same gates.
  Result<MatchVerdict> verify(const KeyframeView& query, const KeyframeView& candidate, SurfelMap& map,
                              const Pose& T_map_candidate, const std::optional<Pose>& T_candidate_believed = {});

 private:
  Alignment alignFine(const ReferenceView& reference, const Pyramid& frame, const Pose& T_guess);
  Alignment alignCoarse(const KeyframeView& query, const KeyframeView& candidate,
                        const std::optional<Pose>& T_candidate_believed);

  const char* objection(const KeyframeView& query, const KeyframeView& candidate, const Alignment& near,
                        MatchVerdict& verdict) const;
  Result<void> predict(SurfelMap& map, const CameraModel& camera, const Pose& T_map_cam);

  VerifierOptions options_;
  PointResiduals workspace_;
  Pyramid half_;       // of the predicted view, from half the picture's size on
  Pyramid predicted_;  // the same with the levels' usual numbers; level 0 is empty
};

}  // namespace comap
