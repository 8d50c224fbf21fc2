#include "mapping_core/verify/match_verifier.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mapping_core/rgbd/appearance.h"
#include "mapping_core/rgbd/depth_agreement.h"
#include "mapping_core/rgbd/seeded_alignment.h"

namespace comap {
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

  const Pose T_map_predicted = T_map_candidate * coarse.T_ref_cur;
  PredictionOptions prediction;
  auto view = map.predict(query.camera, T_map_predicted, prediction);
  if (!view) return view.error();
  buildPyramid(view->colour, view->depth_m, query.camera, 4, predicted_);
  const ReferenceView reference = fineReference(predicted_, options_.noise);

  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {8, 8};
  options.coarse_gate_m = 0.15f;
  options.distance_gate_m = 0.08f;
  const Alignment forth = align(reference, query.pyramid, Pose(), options, workspace_);
  verdict.inlier_ratio = forth.inlier_ratio;
  verdict.rms_sigma = forth.solved ? forth.rms_sigma : 0;
  verdict.degeneracy = forth.degeneracy;
  verdict.photometric_median = forth.photometric_median;
  verdict.information = forth.information;
  verdict.T_candidate_query = coarse.T_ref_cur * forth.T_ref_cur;
  if (!forth.solved) return refuse("too_few_points");
  if (forth.inlier_ratio < options_.inlier_ratio) return refuse("inlier_ratio");
  if (forth.overlap * forth.inlier_ratio < options_.overlap) return refuse("overlap");
  if (forth.rms_sigma > options_.rms_sigma) return refuse("rms_sigma");
  if (forth.degeneracy < options_.degeneracy) return refuse("degenerate");
  if (forth.photometric_median > options_.photometric_median) return refuse("photometric");

  constexpr size_t kCompareLevel = 2;
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

  const Alignment back = align(query.fine, predicted_, forth.T_ref_cur.inverse(), options, workspace_);
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
