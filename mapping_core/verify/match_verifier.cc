#include "mapping_core/verify/match_verifier.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mapping_core/rgbd/appearance.h"
#include "mapping_core/rgbd/depth_agreement.h"
#include "mapping_core/rgbd/seeded_alignment.h"

namespace comap {
namespace {

// One keyframe is noisier than the map and shows less of it: what these gates stop is far from passing the full ones.
constexpr double kNearInliers = 0.8;      // of the full gate
constexpr double kNearUnlike = 2;         // times the full gate
constexpr double kNearDegeneracy = 0.25;  // of the full gate
constexpr size_t kCompareLevel = 2;

}  // namespace

Alignment MatchVerifier::alignFine(const ReferenceView& reference, const Pyramid& frame, const Pose& T_guess) {
  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {8, 8};
  options.coarse_gate_m = 0.15f;
  options.distance_gate_m = 0.08f;
  return align(reference, frame, T_guess, options, workspace_);
}

Alignment MatchVerifier::alignCoarse(const KeyframeView& query, const KeyframeView& candidate,
                                     const std::optional<Pose>& T_candidate_believed) {
  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {20, 10};
  options.coarse_gate_m = 0.6f;
  options.distance_gate_m = 0.15f;
  options.coarse_extra_sigma_m = 0.08f;
  const double a = options_.seed_rad;
  std::vector<Pose> seeds = {Pose(),       turned(0, a), turned(0, -a), turned(0, 2 * a), turned(0, -2 * a),
                             turned(a, 0), turned(-a, 0)};
  if (T_candidate_believed) seeds.push_back(*T_candidate_believed);
  return alignFromSeeds(candidate.coarse, query.pyramid, seeds, options, workspace_);
}

// What speaks against the candidate before its map is looked at; null if nothing does.
const char* MatchVerifier::objection(const KeyframeView& query, const KeyframeView& candidate, const Alignment& near,
                                     MatchVerdict& verdict) const {
  verdict.inlier_ratio = near.inlier_ratio;
  verdict.rms_sigma = near.solved ? near.rms_sigma : 0;
  verdict.degeneracy = near.degeneracy;
  verdict.photometric_median = near.photometric_median;
  if (!near.solved) return "too_few_points";
  if (near.inlier_ratio < kNearInliers * options_.inlier_ratio) return "inlier_ratio";
  if (near.degeneracy < kNearDegeneracy * options_.degeneracy) return "degenerate";
  const Appearance appearance =
      compareAppearance(candidate.pyramid[kCompareLevel], query.pyramid[kCompareLevel], near.T_ref_cur, options_.noise);
  verdict.unlike = appearance.unlikeShare();
  verdict.features = appearance.featureShare();
  return verdict.unlike > kNearUnlike * options_.unlike ? "unlike" : nullptr;
}

// Alignment and gates look at levels 1 and coarser, so the map is drawn in half the size.
Result<void> MatchVerifier::predict(SurfelMap& map, const CameraModel& camera, const Pose& T_map_cam) {
  const CameraModel half = camera.shrunk(2);
  auto view = map.predict(half, T_map_cam, {});
  if (!view) return view.error();
  buildPyramid(view->colour, view->depth_m, half, 3, half_);
  predicted_.resize(half_.size() + 1);
  for (size_t level = 0; level < half_.size(); ++level) std::swap(predicted_[level + 1], half_[level]);
  return {};
}

Result<MatchVerdict> MatchVerifier::verify(const KeyframeView& query, const KeyframeView& candidate, SurfelMap& map,
                                           const Pose& T_map_candidate,
                                           const std::optional<Pose>& T_candidate_believed) {
  MatchVerdict verdict;
  verdict.query = query.id;
  verdict.candidate = candidate.id;
  const auto refuse = [&](const char* reason) {
    verdict.reason = reason;
    return verdict;
  };

  const Alignment coarse = alignCoarse(query, candidate, T_candidate_believed);
  verdict.T_candidate_query = coarse.T_ref_cur;
  verdict.inlier_ratio = coarse.inlier_ratio;
  verdict.rms_sigma = coarse.solved ? coarse.rms_sigma : 0;
  if (!coarse.solved || coarse.inlier_ratio < options_.coarse_inlier_ratio) return refuse("coarse_alignment");

  const Alignment near = alignFine(candidate.fine, query.pyramid, coarse.T_ref_cur);
  verdict.T_candidate_query = near.T_ref_cur;
  if (const char* reason = objection(query, candidate, near, verdict)) return refuse(reason);

  if (auto drawn = predict(map, query.camera, T_map_candidate * near.T_ref_cur); !drawn) return drawn.error();
  const Alignment forth = alignFine(fineReference(predicted_, options_.noise), query.pyramid, Pose());
  verdict.inlier_ratio = forth.inlier_ratio;
  verdict.rms_sigma = forth.solved ? forth.rms_sigma : 0;
  verdict.degeneracy = forth.degeneracy;
  verdict.photometric_median = forth.photometric_median;
  verdict.information = forth.information;
  verdict.T_candidate_query = near.T_ref_cur * forth.T_ref_cur;
  if (!forth.solved) return refuse("too_few_points");
  if (forth.inlier_ratio < options_.inlier_ratio) return refuse("inlier_ratio");
  if (forth.overlap * forth.inlier_ratio < options_.overlap) return refuse("overlap");
  if (forth.rms_sigma > options_.rms_sigma) return refuse("rms_sigma");
  if (forth.degeneracy < options_.degeneracy) return refuse("degenerate");
  if (forth.photometric_median > options_.photometric_median) return refuse("photometric");

  const DepthAgreement agreement = compareDepth(predicted_[kCompareLevel], query.pyramid[kCompareLevel],
                                                forth.T_ref_cur, options_.behind_m, options_.noise);
  verdict.seen_through = agreement.seen_through;
  if (agreement.seen_through > options_.seen_through) return refuse("seen_through");
  if (agreement.agree < 0.5) return refuse("depth_disagrees");

  const Appearance appearance =
      compareAppearance(predicted_[kCompareLevel], query.pyramid[kCompareLevel], forth.T_ref_cur, options_.noise);
  verdict.unlike = appearance.unlikeShare();
  verdict.features = appearance.featureShare();
  if (verdict.unlike > options_.unlike) return refuse("unlike");
  if (verdict.features < options_.features) return refuse("featureless");

  const Alignment back = alignFine(query.fine, predicted_, forth.T_ref_cur.inverse());
  const Pose loop = forth.T_ref_cur * back.T_ref_cur;
  verdict.round_trip_m = loop.translation().norm();
  verdict.round_trip_rad = loop.angle();
  if (!back.solved || verdict.round_trip_m > options_.round_trip_m || verdict.round_trip_rad > options_.round_trip_rad)
    return refuse("round_trip");

  verdict.accepted = true;
  verdict.reason = "accepted";
  return verdict;
}

}  // namespace comap
