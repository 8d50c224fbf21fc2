// The part of MapBuilder that asks which stored keyframes see what a new one sees.
#include <algorithm>
#include <utility>

#include "mapping_core/service/map_builder.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {

Result<std::vector<MatchVerdict>> MapBuilder::match(const Keyframe& keyframe, const FernCode& code, Pace pace) {
  auto verdicts = askAll(keyframe.id, keyframe.believed, candidatesOf(keyframe, code, pace),
                         asked_.refusedBefore(keyframe, T_map_cam_));
  if (!verdicts) return verdicts;
  std::vector<KeyframeId> asked, refused;
  for (const MatchVerdict& verdict : *verdicts) {
    asked.push_back(verdict.candidate);
    if (!verdict.accepted) refused.push_back(verdict.candidate);
  }
  if (pace == Pace::kHasty) unasked_.push_back({keyframe.id, std::move(asked)});
  asked_.note(keyframe.id, std::move(refused));
  return verdicts;
}

std::vector<Candidate> MapBuilder::candidatesOf(const Keyframe& keyframe, const FernCode& code, Pace pace) const {
  std::vector<Candidate> candidates = search_.search(keyframe.id, code, [&](const KeyframeId& other) {
    if (!components_.together(other, keyframe.id)) return Kinship::kForeign;
    if (pace == Pace::kHasty) return Kinship::kNone;
    return watch_.inDoubt(other, keyframe.id) ? Kinship::kForeign : Kinship::kOwn;
  });
  // A robot that recognised another map's surface says where to look; what it believes is verified as all else is.
  if (keyframe.believed) {
    const auto others = othersIn(keyframe.believed->map, keyframe.id);
    const auto near = search_.around(code, keyframe.believed->T_map_cam, others, candidates);
    candidates.insert(candidates.end(), near.begin(), near.end());
  }
  return candidates;
}

// None whose place is `known` or was refused before in this call, in the map of the query none whose place was matched;
// but all that the robot itself names.
Result<std::vector<MatchVerdict>> MapBuilder::askAll(const KeyframeId& id, const std::optional<MapPose>& believed,
                                                     std::span<const Candidate> candidates,
                                                     std::vector<KeyframeId> known) {
  const StageSpan span("match");
  std::vector<MatchVerdict> verdicts;
  const auto query = shelf_.view(id);
  if (!query) return query.error();
  for (const Candidate& candidate : candidates) {
    const auto same = [&](const KeyframeId& other) {
      return components_.together(candidate.id, other) &&
             asked_.samePlace(T_map_cam_.at(candidate.id), T_map_cam_.at(other));
    };
    if (!candidate.believed && std::any_of(known.begin(), known.end(), same)) continue;
    auto verdict = ask(**query, believed, candidate);
    if (!verdict) return verdict.error();
    // Between maps each further match is a vote, or tells of another that is.
    if (!verdict->accepted || components_.together(candidate.id, id)) known.push_back(candidate.id);
    verdicts.push_back(std::move(*verdict));
  }
  return verdicts;
}

Result<MatchVerdict> MapBuilder::ask(const KeyframeView& query, const std::optional<MapPose>& believed,
                                     const Candidate& candidate) {
  const auto view = shelf_.view(candidate.id);
  if (!view) return view.error();
  const KeyframeId anchor = components_.anchorOf(candidate.id);
  const Pose& T_map_candidate = T_map_cam_.at(candidate.id);
  std::optional<Pose> T_candidate_believed;
  if (believed && believed->map == mapIdOf(anchor))
    T_candidate_believed = T_map_candidate.inverse() * believed->T_map_cam;
  auto verdict = verifier_.verify(query, **view, surfels_.at(anchor), T_map_candidate, T_candidate_believed);
  if (verdict) verdict->fern_dissimilarity = candidate.dissimilarity;
  return verdict;
}

// Stores what was found, and does what follows from it.
Result<void> MapBuilder::take(std::span<const MatchVerdict> verdicts, MapChange& change) {
  for (const MatchVerdict& verdict : verdicts) {
    change.verdicts.push_back(verdict);
    if (auto stored = store_.addVerdict(verdict); !stored) return stored;
    if (!verdict.accepted) continue;
    if (auto connected = connect(verdict, change); !connected) return connected;
  }
  return {};
}

Result<MapChange> MapBuilder::askNext() {
  MapChange change;
  if (unasked_.empty()) return change;
  if (auto fused = catchUp(surfels_.waiting()); !fused) return fused.error();
  auto transaction = store_.begin(Durable::kWithNext);
  if (!transaction) return transaction.error();
  Unasked next = std::move(unasked_.front());
  unasked_.pop_front();
  const KeyframeId& id = next.id;
  if (auto tied = tieLive(id); !tied) return tied.error();
  const auto candidates = search_.search(id, *search_.code(id), [&](const KeyframeId& other) {
    if (!components_.together(other, id) || index_.at(other) > index_.at(id)) return Kinship::kNone;
    return watch_.inDoubt(other, id) ? Kinship::kForeign : Kinship::kOwn;
  });
  const auto verdicts = askAll(id, {}, candidates, std::move(next.asked));  // a pair is judged once
  if (!verdicts) return verdicts.error();
  if (auto taken = take(*verdicts, change); !taken) return taken.error();
  if (auto judged = judgeMerges({}, change); !judged) return judged.error();
  change.map = mapIdOf(components_.anchorOf(id));
  if (auto stored = storeChanged(id, change); !stored) return stored.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

// The keyframes of a map, if that is another than the one `id` is in.
std::vector<std::pair<KeyframeId, Pose>> MapBuilder::othersIn(const MapId& map, const KeyframeId& id) const {
  std::vector<std::pair<KeyframeId, Pose>> others;
  for (const KeyframeId& anchor : components_.anchors()) {
    if (mapIdOf(anchor) != map || components_.anchorOf(id) == anchor) continue;
    for (const KeyframeId& member : components_.members(anchor)) others.emplace_back(member, T_map_cam_.at(member));
  }
  return others;
}

}  // namespace comap
