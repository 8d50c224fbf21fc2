// What a survey found whole, into a new store.
#include <set>

#include "mapping_core/store/store_survey.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

// Keyframes that the core had mapped: those with a pose, and those with an edge, whose pose is lost.
std::set<KeyframeId> mappedOf(const StoreSurvey& survey) {
  std::set<KeyframeId> mapped;
  for (const StoredKeyframe& keyframe : survey.keyframes)
    if (!keyframe.map.empty()) mapped.insert(keyframe.id);
  for (const WithdrawnEdge& one : survey.edges) mapped.insert({one.edge.from, one.edge.to});
  return mapped;
}

// Returns the odometry edges that the messages tell of and the table does not.
Result<std::vector<Edge>> saveKeyframes(const StoreSurvey& survey, Database& from, MapStore& to) {
  const std::set<KeyframeId> mapped = mappedOf(survey);
  std::set<KeyframeId> tied;
  for (const WithdrawnEdge& one : survey.edges)
    if (one.edge.kind == EdgeKind::kOdometry) tied.insert(one.edge.to);
  std::vector<Edge> lost;
  for (const StoredKeyframe& stored : survey.keyframes) {
    const auto message = messageOf(from, stored.arrival);
    if (!message) return message.error();
    if (auto added = to.addKeyframe(stored.id, stored.stamp_ns, *message); !added) return added.error();
    if (!mapped.contains(stored.id)) continue;
    const MapId map = stored.map.empty() ? toString(stored.id) : stored.map;  // computed anew, as the pose
    if (auto placed = to.setPoses(map, {{stored.id, stored.T_map_cam}}); !placed) return placed.error();
    const auto keyframe = decodeKeyframeWithoutImages(*message);
    if (!keyframe) return keyframe.error();
    const KeyframeId previous{stored.id.robot, stored.id.session, keyframe->linked_to};
    if (keyframe->linked && mapped.contains(previous) && !tied.contains(stored.id))
      lost.push_back({previous, stored.id, EdgeKind::kOdometry, keyframe->T_link_this, keyframe->information});
  }
  return lost;
}

Result<void> saveMerges(const StoreSurvey& survey, MapStore& to) {
  for (const MergeRecord& merge : survey.merges) {
    if (auto added = to.addMerge(merge); !added) return added;
    if (merge.undone.empty()) continue;
    if (auto undone = to.undoMerge(merge.number, merge.undone, survey.undone_by.at(merge.number)); !undone)
      return undone;
  }
  return {};
}

}  // namespace

Result<void> saveWhole(const StoreSurvey& survey, MapStore& to) {
  auto from = openDamaged(survey.path, nullptr);
  if (!from) return from.error();
  auto transaction = to.begin();
  if (!transaction) return transaction.error();
  for (const auto& [key, value] : survey.meta)
    if (auto set = to.setMeta(key, value); !set) return set;
  if (auto set = to.setMeta("complete", "no"); !set) return set;
  if (auto set = to.setVotesWait(true); !set) return set;
  const auto lost_ties = saveKeyframes(survey, *from, to);
  if (!lost_ties) return lost_ties.error();
  if (auto saved = saveMerges(survey, to); !saved) return saved;
  std::set<uint32_t> merges = {0};
  for (const MergeRecord& merge : survey.merges) merges.insert(merge.number);
  for (const WithdrawnEdge& one : survey.edges) {
    if (!merges.contains(one.edge.merge)) continue;
    if (auto added = to.addEdge(one.edge); !added) return added;
    if (one.withdrawn_by == 0) continue;
    if (auto withdrawn = to.withdrawEdge(one.edge, one.withdrawn_by); !withdrawn) return withdrawn;
  }
  for (const Edge& edge : *lost_ties)
    if (auto added = to.addEdge(edge); !added) return added;
  for (const MatchVerdict& verdict : survey.verdicts)
    if (auto added = to.addVerdict(verdict); !added) return added;
  return transaction->commit();
}

}  // namespace comap
