#include "fleet_tools/evaluate/evaluate_closures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fleet_tools/evaluate/keyframe_truth.h"
#include "mapping_core/store/map_store.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

using nlohmann::json;

constexpr int kStride = 4;         // of the kept depths
constexpr double kFarthest_m = 5;  // depths beyond are too rough to compare
constexpr double kSame_m = 0.05, kSamePart = 0.03;

KeyframePair pairOf(const KeyframeId& a, const KeyframeId& b) {
  return a < b ? KeyframePair(a, b) : KeyframePair(b, a);
}

std::optional<double> share(size_t part, size_t all) {
  if (all == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(all);
}

json orNull(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

// Whether a match is right; nullopt if one end has no truth.
std::optional<bool> judge(const ClosureTruth& truth, const MatchVerdict& verdict, const ClosureBounds& bounds) {
  const auto query = truth.T_truth_cam.find(verdict.query), candidate = truth.T_truth_cam.find(verdict.candidate);
  if (query == truth.T_truth_cam.end() || candidate == truth.T_truth_cam.end()) return std::nullopt;
  return isRight(candidate->second.inverse() * query->second, verdict.T_candidate_query, bounds);
}

void scoreMerges(const ClosureTruth& truth, const std::vector<MatchVerdict>& verdicts,
                 const std::vector<MergeRecord>& merges, const ClosureBounds& bounds, ClosureScore& score) {
  std::map<KeyframeId, std::vector<const MatchVerdict*>> accepted;
  for (const MatchVerdict& verdict : verdicts)
    if (verdict.accepted) accepted[verdict.query].push_back(&verdict);
  for (const MergeRecord& merge : merges) {
    ++score.merges;
    // A voter's matches into its own map are no votes, but they are wrong as rarely; what cannot be judged is no proof.
    bool wrong = false, judged = false;
    double latest_s = 0;
    for (const KeyframeId& voter : merge.voters) {
      if (const auto stamp = truth.stamp_s.find(voter); stamp != truth.stamp_s.end())
        latest_s = std::max(latest_s, stamp->second);
      for (const MatchVerdict* verdict : accepted[voter]) {
        const auto right = judge(truth, *verdict, bounds);
        judged = judged || right.has_value();
        wrong = wrong || (right && !*right);
      }
    }
    score.false_merges += wrong;
    score.false_merges_standing += wrong && merge.undone.empty();
    if (wrong || !judged || score.first_merge_s) continue;
    score.first_merge_s = latest_s;
    score.first_merge_keyframes = merge.keyframes_ingested;
  }
}

}  // namespace

bool isRight(const Pose& truth, const Pose& found, const ClosureBounds& bounds) {
  const Pose error = truth.inverse() * found;
  return error.translation().norm() <= bounds.translation_m &&
         error.angle() * 180 / std::numbers::pi <= bounds.rotation_deg;
}

std::optional<double> ClosureScore::precision() const { return share(right, accepted); }
std::optional<double> ClosureScore::pairRecall() const { return share(pairs_found, pairs); }
std::optional<double> ClosureScore::queryRecall() const { return share(queries_found, queries); }

ClosureScore scoreClosures(const ClosureTruth& truth, const std::vector<MatchVerdict>& verdicts,
                           const std::vector<MergeRecord>& merges, const ClosureBounds& bounds) {
  ClosureScore score;
  std::set<KeyframePair> found;
  std::set<KeyframeId> answered;
  for (const MatchVerdict& verdict : verdicts) {
    if (!verdict.accepted || verdict.query.robot == verdict.candidate.robot) continue;
    const auto right = judge(truth, verdict, bounds);
    if (!right) continue;
    ++score.accepted;
    if (!*right) continue;
    ++score.right;
    found.insert(pairOf(verdict.query, verdict.candidate));
    answered.insert(verdict.query);
  }
  score.pairs = truth.overlapping.size();
  for (const KeyframePair& pair : truth.overlapping) score.pairs_found += found.contains(pair);
  std::map<KeyframeId, size_t> arrival;
  for (const KeyframeId& id : truth.order) arrival.emplace(id, arrival.size());
  std::set<KeyframeId> queries;
  for (const auto& [a, b] : truth.overlapping) queries.insert(arrival.at(a) < arrival.at(b) ? b : a);
  score.queries = queries.size();
  for (const KeyframeId& id : queries) score.queries_found += answered.contains(id);
  scoreMerges(truth, verdicts, merges, bounds, score);
  return score;
}

CoarseView coarseView(const CameraModel& camera, const DepthImage& depth) {
  CoarseView view;
  view.camera = camera;
  view.depth = DepthImage((depth.width() + kStride - 1) / kStride, (depth.height() + kStride - 1) / kStride);
  for (int v = 0; v < view.depth.height(); ++v)
    for (int u = 0; u < view.depth.width(); ++u) view.depth.at(u, v) = depth.at(u * kStride, v * kStride);
  constexpr int kEvery = 4 * kStride;
  for (int v = kEvery / 2; v < depth.height(); v += kEvery)
    for (int u = kEvery / 2; u < depth.width(); u += kEvery) {
      const double z = depth.at(u, v) / kDepthUnitsPerMetre;
      if (z > 0 && z <= kFarthest_m) view.points.push_back(camera.unproject(u, v, z));
    }
  return view;
}

double overlapOf(const CoarseView& a, const CoarseView& b, const Pose& T_b_a) {
  if (a.points.empty()) return 0;
  size_t seen = 0;
  for (const Eigen::Vector3d& point : a.points) {
    const Eigen::Vector3d p = T_b_a * point;
    if (p.z() < 0.1) continue;
    const int u = static_cast<int>(std::lround((b.camera.fx * p.x() / p.z() + b.camera.cx) / kStride));
    const int v = static_cast<int>(std::lround((b.camera.fy * p.y() / p.z() + b.camera.cy) / kStride));
    if (!b.depth.contains(u, v) || b.depth.at(u, v) == 0) continue;
    const double z = b.depth.at(u, v) / kDepthUnitsPerMetre;
    seen += std::abs(z - p.z()) <= kSame_m + kSamePart * p.z();
  }
  return static_cast<double>(seen) / static_cast<double>(a.points.size());
}

Result<ClosureScore> evaluateClosures(const std::string& path, const std::map<std::string, std::string>& truths,
                                      const ClosureBounds& bounds) {
  auto store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return store.error();
  const auto keyframes = store->keyframes();
  if (!keyframes) return keyframes.error();
  ClosureTruth truth;
  std::map<std::string, int64_t> first_ns;
  for (const StoredKeyframe& keyframe : *keyframes) {
    truth.order.push_back(keyframe.id);
    const auto [first, fresh] = first_ns.emplace(keyframe.id.robot, keyframe.stamp_ns);
    first->second = std::min(first->second, keyframe.stamp_ns);
  }
  for (const StoredKeyframe& keyframe : *keyframes)
    truth.stamp_s[keyframe.id] = 1e-9 * static_cast<double>(keyframe.stamp_ns - first_ns.at(keyframe.id.robot));
  auto T_truth_cam = keyframeTruth(*keyframes, truths);
  if (!T_truth_cam) return T_truth_cam.error();
  truth.T_truth_cam = std::move(*T_truth_cam);
  std::vector<std::pair<KeyframeId, CoarseView>> views;
  for (const KeyframeId& id : truth.order) {
    if (!truth.T_truth_cam.contains(id)) continue;
    const auto encoded = store->encodedKeyframe(id);
    if (!encoded) return encoded.error();
    const auto keyframe = decodeKeyframe(*encoded);
    if (!keyframe)
      return Error{keyframe.error().code, path + ": keyframe " + toString(id) + ": " + keyframe.error().text};
    views.emplace_back(id, coarseView(keyframe->camera, keyframe->depth));
  }
  for (size_t i = 0; i < views.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      if (views[i].first.robot == views[j].first.robot) continue;
      const Pose T_j_i = truth.T_truth_cam.at(views[j].first).inverse() * truth.T_truth_cam.at(views[i].first);
      if (T_j_i.translation().norm() > 2 * kFarthest_m) continue;
      if (overlapOf(views[i].second, views[j].second, T_j_i) >= bounds.overlap &&
          overlapOf(views[j].second, views[i].second, T_j_i.inverse()) >= bounds.overlap)
        truth.overlapping.insert(pairOf(views[i].first, views[j].first));
    }
  const auto verdicts = store->verdicts();
  if (!verdicts) return verdicts.error();
  const auto merges = store->merges();
  if (!merges) return merges.error();
  return scoreClosures(truth, *verdicts, *merges, bounds);
}

json toJson(const ClosureScore& score) {
  return {{"accepted", score.accepted},
          {"right", score.right},
          {"precision", orNull(score.precision())},
          {"overlapping_pairs", score.pairs},
          {"pairs_found", score.pairs_found},
          {"pair_recall", orNull(score.pairRecall())},
          {"overlapping_keyframes", score.queries},
          {"keyframes_found", score.queries_found},
          {"keyframe_recall", orNull(score.queryRecall())},
          {"merges", score.merges},
          {"false_merges", score.false_merges},
          {"false_merges_standing", score.false_merges_standing},
          {"first_merge_s", orNull(score.first_merge_s)},
          {"first_merge_keyframes", score.first_merge_keyframes ? json(*score.first_merge_keyframes) : json(nullptr)}};
}

}  // namespace comap
