#include "edge_agent/odometry/relocaliser.h"

#include <algorithm>
#include <vector>

#include "mapping_core/rgbd/depth_agreement.h"
#include "mapping_core/rgbd/seeded_alignment.h"

namespace comap {
namespace {

constexpr size_t kLevel = kPlaceLevel, kCoarseLevel = kPlaceLevel + 1;
constexpr ReferenceOptions kReference{kPlaceLevel, kPlaceLevel + 1, 3000};

bool contradict(const Relocalisation& a, const Relocalisation& b, const RelocaliserOptions& options) {
  const Pose difference = (a.T_odom_keyframe * a.T_keyframe_cam).inverse() * (b.T_odom_keyframe * b.T_keyframe_cam);
  return difference.translation().norm() > options.ambiguous_m || difference.angle() > options.ambiguous_rad;
}

// Accepted before refused, then by how well it fits.
bool better(const Relocalisation& a, const Relocalisation& b) {
  if (a.accepted != b.accepted) return a.accepted;
  return fitScore(a.inlier_ratio, a.overlap) > fitScore(b.inlier_ratio, b.overlap);
}

}  // namespace

Relocalisation Relocaliser::relocalise(const Pyramid& live, const FernCode& code) {
  Relocalisation best;
  if (live.size() <= kCoarseLevel) {
    best.reason = "too_few_levels";
    return best;
  }
  best.reason = "no_similar_place";
  const auto candidates = memory_.similar(code, options_.candidates, options_.max_dissimilarity);
  if (candidates.empty()) return best;
  const ReferenceView live_reference = buildReference(live, kReference, options_.noise);
  std::vector<Relocalisation> judged;
  for (const PlaceCandidate& candidate : candidates) {
    judged.push_back(judge(memory_.at(candidate.place), live, live_reference));
    judged.back().dissimilarity = candidate.dissimilarity;
  }
  best = *std::min_element(judged.begin(), judged.end(), better);
  if (!best.accepted) return best;
  for (const Relocalisation& other : judged)
    if (other.accepted && contradict(best, other, options_)) {
      best.accepted = false;
      best.reason = "ambiguous";
    }
  return best;
}

Relocalisation Relocaliser::judge(const RememberedPlace& place, const Pyramid& live,
                                  const ReferenceView& live_reference) {
  Relocalisation result;
  result.sequence = place.sequence;
  result.T_odom_keyframe = place.T_odom_keyframe;
  const auto refuse = [&](const char* reason) {
    result.reason = reason;
    return result;
  };
  const auto take = [&](const Alignment& alignment) {
    result.T_keyframe_cam = alignment.T_ref_cur;
    result.inlier_ratio = alignment.inlier_ratio;
    result.overlap = alignment.overlap;
    result.rms_sigma = alignment.solved ? alignment.rms_sigma : 0;
    result.degeneracy = alignment.degeneracy;
    result.photometric_median = alignment.photometric_median;
  };
  const Pyramid remembered = place.pyramid();
  const ReferenceView reference = buildReference(remembered, kReference, options_.noise);
  const Alignment coarse = alignFromAround(
      reference, remembered, live, {kCoarseLevel, options_.seed_rad, options_.noise}, workspace_, rotation_workspace_);
  take(coarse);
  if (!coarse.solved || coarse.inlier_ratio < options_.coarse_inlier_ratio) return refuse("coarse_alignment");

  AlignmentOptions options;
  options.noise = options_.noise;
  options.iterations = {6, 12};
  options.coarse_gate_m = 0.15f;
  options.distance_gate_m = 0.08f;
  const Alignment forth = align(reference, live, coarse.T_ref_cur, options, workspace_);
  take(forth);
  if (!forth.solved || !forth.T_ref_cur.isFinite()) return refuse("too_few_points");
  if (forth.inlier_ratio < options_.inlier_ratio) return refuse("inlier_ratio");
  if (forth.overlap * forth.inlier_ratio < options_.overlap) return refuse("overlap");
  if (forth.rms_sigma > options_.rms_sigma) return refuse("rms_sigma");
  if (forth.degeneracy < options_.degeneracy) return refuse("degenerate");
  if (forth.photometric_median > options_.photometric_median) return refuse("photometric");

  const DepthAgreement there =
      compareDepth(remembered[kLevel], live[kLevel], forth.T_ref_cur, options_.gate_m, options_.noise);
  const DepthAgreement back_again =
      compareDepth(live[kLevel], remembered[kLevel], forth.T_ref_cur.inverse(), options_.gate_m, options_.noise);
  result.seen_through = std::max(there.seen_through, back_again.seen_through);
  result.agree = std::min(there.agree, back_again.agree);
  if (result.seen_through > options_.seen_through) return refuse("seen_through");
  if (result.agree < options_.agree) return refuse("depth_disagrees");

  const Alignment back = align(live_reference, remembered, forth.T_ref_cur.inverse(), options, workspace_);
  const Pose loop = forth.T_ref_cur * back.T_ref_cur;
  result.round_trip_m = loop.translation().norm();
  result.round_trip_rad = loop.angle();
  const bool closed =
      back.solved && result.round_trip_m <= options_.round_trip_m && result.round_trip_rad <= options_.round_trip_rad;
  if (!closed) return refuse("round_trip");
  result.accepted = true;
  result.reason = "accepted";
  return result;
}

}  // namespace comap
