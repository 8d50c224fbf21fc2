#include "edge_agent/map_cache/map_registration.h"

#include <algorithm>

#include "mapping_core/rgbd/depth_agreement.h"
#include "mapping_core/rgbd/seeded_alignment.h"

namespace comap {
namespace {

constexpr size_t kDrawnLevel = 1, kLevel = 2, kCoarseLevel = 3;
constexpr ReferenceOptions kReference{kLevel, kCoarseLevel, 3000};

void take(const Alignment& alignment, const Pose& T_map_ref, Registration& result) {
  result.T_map_cam = T_map_ref * alignment.T_ref_cur;
  // From an increment in the reference's frame to one in the camera's own.
  const Matrix6d ad = alignment.T_ref_cur.adjoint();
  result.information = ad.transpose() * alignment.information * ad;
  result.inlier_ratio = alignment.inlier_ratio;
  result.overlap = alignment.overlap;
  result.rms_sigma = alignment.solved ? alignment.rms_sigma : 0;
  result.degeneracy = alignment.degeneracy;
  result.photometric_median = alignment.photometric_median;
}

// What every aligned view is asked, as far as `gates` go.
struct Gates {
  double inlier_ratio, overlap, rms_sigma, degeneracy, photometric_median;
};

// The check that the alignment fails; null if none.
const char* failedGate(const Alignment& alignment, const Gates& gates) {
  if (!alignment.solved || !alignment.T_ref_cur.isFinite()) return "too_few_points";
  if (alignment.inlier_ratio < gates.inlier_ratio) return "inlier_ratio";
  if (alignment.overlap * alignment.inlier_ratio < gates.overlap) return "overlap";
  if (alignment.rms_sigma > gates.rms_sigma) return "rms_sigma";
  if (alignment.degeneracy < gates.degeneracy) return "degenerate";
  if (alignment.photometric_median > gates.photometric_median) return "photometric";
  return nullptr;
}

Registration refused(Registration result, const char* reason) {
  result.accepted = false;
  result.reason = reason;
  return result;
}

Registration accepted(Registration result) {
  result.accepted = true;
  result.reason = "accepted";
  return result;
}

}  // namespace

// Draws the map into predicted_, with the level numbers of the live pyramid. False if there is too little of it.
bool MapRegistration::predict(const TileCache& cache, const Pyramid& live, const Pose& T_map_cam) {
  const TileView& view = renderer_.render(cache, live[kDrawnLevel].camera, T_map_cam);
  if (view.filled < options_.filled) return false;
  if (!predicted_.empty()) predicted_.erase(predicted_.begin());
  buildPyramid(view.colour, view.depth_m, view.camera, static_cast<int>(kCoarseLevel - kDrawnLevel + 1), predicted_);
  predicted_.insert(predicted_.begin(), PyramidLevel{});
  buildReference(predicted_, kReference, options_.noise, nullptr, picked_, reference_);
  return true;
}

Registration MapRegistration::near(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess) {
  Registration result;
  result.T_map_cam = T_map_guess;
  if (live.size() <= kCoarseLevel) return refused(result, "too_few_levels");
  if (!predict(cache, live, T_map_guess)) return refused(result, "unmapped");
  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {6, 8};
  options.coarse_gate_m = 0.25f;
  options.distance_gate_m = 0.10f;
  options.coarse_extra_sigma_m = 0.02f;
  const Alignment alignment = align(reference_, live, Pose(), options, workspace_);
  take(alignment, T_map_guess, result);
  // Near where it is believed to be, directions that the view leaves open are no reason: they count for little.
  const Gates gates{options_.inlier_ratio, options_.overlap, options_.rms_sigma, 0, options_.photometric_median};
  if (const char* failed = failedGate(alignment, gates)) return refused(result, failed);
  if (alignment.T_ref_cur.translation().norm() > options_.jump_m || alignment.T_ref_cur.angle() > options_.jump_rad)
    return refused(result, "jump");
  return accepted(result);
}

Registration MapRegistration::anywhere(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess) {
  Registration result;
  result.T_map_cam = T_map_guess;
  if (live.size() <= kCoarseLevel) return refused(result, "too_few_levels");
  if (!predict(cache, live, T_map_guess)) return refused(result, "unmapped");
  const Alignment coarse = alignFromAround(
      reference_, predicted_, live, {kCoarseLevel, options_.seed_rad, options_.noise}, workspace_, rotation_workspace_);
  take(coarse, T_map_guess, result);
  if (!coarse.solved || !coarse.T_ref_cur.isFinite() || coarse.inlier_ratio < options_.coarse_inlier_ratio)
    return refused(result, "coarse_alignment");
  return verify(cache, live, result.T_map_cam);
}

Registration MapRegistration::verify(const TileCache& cache, const Pyramid& live, const Pose& T_map_guess) {
  Registration result;
  result.T_map_cam = T_map_guess;
  if (live.size() <= kCoarseLevel) return refused(result, "too_few_levels");
  if (!predict(cache, live, T_map_guess)) return refused(result, "unmapped");
  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {6, 12};
  options.coarse_gate_m = 0.15f;
  options.distance_gate_m = 0.08f;
  const Alignment forth = align(reference_, live, Pose(), options, workspace_);
  take(forth, T_map_guess, result);
  const Gates gates{options_.place_inlier_ratio, options_.place_overlap, options_.place_rms_sigma, options_.degeneracy,
                    options_.place_photometric_median};
  if (const char* failed = failedGate(forth, gates)) return refused(result, failed);

  const DepthAgreement there =
      compareDepth(predicted_[kLevel], live[kLevel], forth.T_ref_cur, options_.gate_m, options_.noise);
  const DepthAgreement back_again =
      compareDepth(live[kLevel], predicted_[kLevel], forth.T_ref_cur.inverse(), options_.gate_m, options_.noise);
  result.seen_through = std::max(there.seen_through, back_again.seen_through);
  result.agree = std::min(there.agree, back_again.agree);
  if (result.seen_through > options_.seen_through) return refused(result, "seen_through");
  if (result.agree < options_.agree) return refused(result, "depth_disagrees");

  const Appearance appearance =
      compareAppearance(predicted_[kLevel], live[kLevel], forth.T_ref_cur, options_.noise, AppearanceOptions{});
  result.unlike = appearance.unlikeShare();
  result.features = appearance.featureShare();
  if (result.unlike > options_.unlike) return refused(result, "unlike");
  if (result.features < options_.features) return refused(result, "featureless");

  buildReference(live, kReference, options_.noise, nullptr, picked_, live_reference_);
  const Alignment back = align(live_reference_, predicted_, forth.T_ref_cur.inverse(), options, workspace_);
  const Pose loop = forth.T_ref_cur * back.T_ref_cur;
  result.round_trip_m = loop.translation().norm();
  result.round_trip_rad = loop.angle();
  if (!back.solved || result.round_trip_m > options_.round_trip_m || result.round_trip_rad > options_.round_trip_rad)
    return refused(result, "round_trip");
  return accepted(result);
}

}  // namespace comap
