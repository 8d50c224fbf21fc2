// What a survey found whole, into a new store.
#include <filesystem>
#include <set>

#include "mapping_core/store/copy_rows.h"
#include "mapping_core/store/merge_again.h"
#include "mapping_core/store/store_survey.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

// But for what speaks of merges that are lost, or of the pages of the other file.
Result<void> saveMeta(const StoreSurvey& survey, MapStore& to) {
  std::set<uint32_t> merges;
  for (const MergeRecord& merge : survey.merges) merges.insert(merge.number);
  for (const auto& [key, value] : survey.meta) {
    const auto merge = mergeOfAgainKey(key);
    if (key == "compact_due" || (merge && !merges.contains(*merge))) continue;
    if (auto set = to.setMeta(key, value); !set) return set;
  }
  if (auto set = to.setMeta("complete", "no"); !set) return set;
  return to.setVotesWait(true);
}

// The core had mapped those with a pose, and those with an edge, whose pose is lost and is computed anew.
bool isMapped(const WholeKeyframe& keyframe) { return !keyframe.stored.map.empty() || keyframe.has_edge; }

Result<void> saveLostPoses(const StoreSurvey& survey, MapStore& to) {
  for (const WholeKeyframe& keyframe : survey.keyframes) {
    if (!isMapped(keyframe) || !keyframe.stored.map.empty()) continue;
    const KeyframeId& id = keyframe.stored.id;
    if (auto placed = to.setPoses(toString(id), {{id, Pose()}}); !placed) return placed;
  }
  return {};
}

// The odometry edges that the messages tell of and the table does not.
Result<void> saveLostTies(const StoreSurvey& survey, Database& from, MapStore& to) {
  std::set<KeyframeId> mapped;
  for (const WholeKeyframe& keyframe : survey.keyframes)
    if (isMapped(keyframe)) mapped.insert(keyframe.stored.id);
  for (const WholeKeyframe& keyframe : survey.keyframes) {
    const KeyframeId& id = keyframe.stored.id;
    const KeyframeId previous{id.robot, id.session, keyframe.linked_to};
    if (!keyframe.linked || keyframe.tied || !mapped.contains(id) || !mapped.contains(previous)) continue;
    const auto message = messageOf(from, keyframe.stored.arrival);
    if (!message) return message.error();
    const auto decoded = decodeKeyframeWithoutImages(*message);
    if (!decoded) return decoded.error();
    if (auto added = to.addEdge({previous, id, EdgeKind::kOdometry, decoded->T_link_this, decoded->information});
        !added)
      return added;
  }
  return {};
}

}  // namespace

Result<void> saveWhole(const StoreSurvey& survey, const std::string& path, bool copied) {
  const std::string absolute = std::filesystem::absolute(path).string();
  if (auto done = copyWholeRows(survey, absolute, copied); !done) return done;
  auto from = openDamaged(survey.path);
  if (!from) return from.error();
  auto to = MapStore::open(absolute, MapStore::Mode::kOpen);
  if (!to) return to.error();
  auto transaction = to->begin();
  if (!transaction) return transaction.error();
  if (auto saved = saveMeta(survey, *to); !saved) return saved;
  if (auto saved = saveLostPoses(survey, *to); !saved) return saved;
  if (auto removed = to->removeClosuresOfNone(); !removed) return removed;
  if (auto saved = saveLostTies(survey, *from, *to); !saved) return saved;
  return transaction->commit();
}

}  // namespace comap
