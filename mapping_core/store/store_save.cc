// What a survey found whole, into a new store.
#include <filesystem>
#include <set>

#include "mapping_core/store/store_survey.h"
#include "mapping_core/store/survey_keyframes.h"

namespace comap {
namespace {

Result<void> saveKeyframes(const StoreSurvey& survey, Database& from, MapStore& to) {
  for (const StoredKeyframe& keyframe : survey.keyframes) {
    const auto message = messageOf(from, keyframe.arrival);
    if (!message) return message.error();
    if (auto added = to.addKeyframe(keyframe.id, keyframe.stamp_ns, *message); !added) return added.error();
    if (keyframe.map.empty()) continue;
    if (auto placed = to.setPoses(keyframe.map, {{keyframe.id, keyframe.T_map_cam}}); !placed) return placed;
  }
  return {};
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
  auto from = Database::open(std::filesystem::absolute(survey.path).string(), SQLITE_OPEN_READONLY);
  if (!from) return from.error();
  auto transaction = to.begin();
  if (!transaction) return transaction.error();
  for (const auto& [key, value] : survey.meta)
    if (auto set = to.setMeta(key, value); !set) return set;
  if (auto set = to.setMeta("complete", "no"); !set) return set;
  if (auto saved = saveKeyframes(survey, *from, to); !saved) return saved;
  if (auto saved = saveMerges(survey, to); !saved) return saved;
  std::set<uint32_t> merges = {0};
  for (const MergeRecord& merge : survey.merges) merges.insert(merge.number);
  for (const WithdrawnEdge& one : survey.edges) {
    if (!merges.contains(one.edge.merge)) continue;
    if (auto added = to.addEdge(one.edge); !added) return added;
    if (one.withdrawn_by == 0) continue;
    if (auto withdrawn = to.withdrawEdge(one.edge, one.withdrawn_by); !withdrawn) return withdrawn;
  }
  for (const MatchVerdict& verdict : survey.verdicts)
    if (auto added = to.addVerdict(verdict); !added) return added;
  return transaction->commit();
}

}  // namespace comap
