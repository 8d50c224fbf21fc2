// Place matches and merges of a run against the truth: which were right, and which were missed.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocol/types/keyframe.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

/// An accepted match is right if its relative pose is no farther than this from the truth.
struct ClosureBounds {
  double translation_m = 0.10, rotation_deg = 5;
  double overlap = 0.5;  ///< two keyframes overlap if each sees at least this share of the other's view
};

/// Of two cameras: whether the pose that was found of one to the other is near enough to the true one.
bool isRight(const Pose& truth, const Pose& found, const ClosureBounds& bounds);

using KeyframePair = std::pair<KeyframeId, KeyframeId>;  ///< first < second

struct ClosureScore {
  size_t accepted = 0, right = 0;         ///< between robots, both ends with a true pose
  size_t pairs = 0, pairs_found = 0;      ///< of keyframes of different robots that truly overlap
  size_t queries = 0, queries_found = 0;  ///< keyframes that overlap with one of another robot that was there before
  size_t merges = 0, false_merges = 0;    ///< records; a merge is false if a match that voted for it is wrong
  size_t false_merges_standing = 0;       ///< those not taken back
  std::optional<double> first_merge_s;    ///< of the right ones: recording time of the robot that completed it
  std::optional<uint32_t> first_merge_keyframes;  ///< keyframes in the core then
  /// Of what there is; nullopt if there is nothing.
  std::optional<double> precision() const;
  std::optional<double> pairRecall() const;
  std::optional<double> queryRecall() const;
};

/// What the score is made of. stamp_s: of each keyframe since its robot's first one. order: keyframes as they arrived.
struct ClosureTruth {
  std::vector<KeyframeId> order;
  std::map<KeyframeId, Pose> T_truth_cam;  ///< those that have one
  std::map<KeyframeId, double> stamp_s;
  std::set<KeyframePair> overlapping;  ///< of different robots
};

ClosureScore scoreClosures(const ClosureTruth& truth, const std::vector<MatchVerdict>& verdicts,
                           const std::vector<MergeRecord>& merges, const ClosureBounds& bounds);

/// Coarse depths of a keyframe, enough to tell what it shares with another.
struct CoarseView {
  CameraModel camera;
  DepthImage depth;                     ///< of every fourth pixel
  std::vector<Eigen::Vector3d> points;  ///< in the camera's frame
};
CoarseView coarseView(const CameraModel& camera, const DepthImage& depth);

/// Share of a's points that b sees at the same depth (5 cm and 3 % of it), 0..1.
double overlapOf(const CoarseView& a, const CoarseView& b, const Pose& T_b_a);

/// Scores the store `path`. truths: robot -> its true trajectory, in one frame for all robots. kBadData and
/// kUnreachable as the store and files give them.
Result<ClosureScore> evaluateClosures(const std::string& path, const std::map<std::string, std::string>& truths,
                                      const ClosureBounds& bounds = {});

nlohmann::json toJson(const ClosureScore& score);

}  // namespace comap
