// What a survey found whole, into a new store.
#include <filesystem>
#include <map>
#include <set>

#include "mapping_core/store/copy_rows.h"
#include "mapping_core/store/merge_again.h"
#include "mapping_core/store/store_survey.h"
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

Result<Keyframe> decoded(const MapStore& store, const WholeKeyframe& keyframe) {
  const auto message = store.encodedKeyframe(keyframe.stored.id);
  if (!message) return message.error();
  return decodeKeyframeWithoutImages(*message);
}

// Whether odometry, which drifts little over so short a way, says what the map says. After a chain's first keyframe it
// need not: nobody knows how far the robot went before that.
bool agree(const Pose& odometry, const Pose& map) {
  const Pose difference = odometry.inverse() * map;
  return difference.translation().norm() < 0.05 + 0.1 * map.translation().norm() && difference.angle() < 0.1;
}

using Mapped = std::map<KeyframeId, const WholeKeyframe*>;

// The tie of a keyframe whose message names one that is not there, or not mapped: to the last one before that of its
// session, if both stood in one map. What the missing one hung on is known to its robot alone; where the two stood, the
// map has kept. As uncertain as if each keyframe between them were tied as this one is.
Result<void> saveTieAcrossGap(const WholeKeyframe& behind, const Mapped& mapped, MapStore& to) {
  const KeyframeId& id = behind.stored.id;
  auto found = mapped.lower_bound({id.robot, id.session, behind.linked_to});
  if (behind.stored.map.empty() || found == mapped.begin()) return {};
  const WholeKeyframe& before = *(--found)->second;
  const KeyframeId& previous = before.stored.id;
  if (previous.robot != id.robot || previous.session != id.session || before.stored.map != behind.stored.map) return {};
  const auto first = decoded(to, before);
  if (!first) return first.error();
  const auto second = decoded(to, behind);
  if (!second) return second.error();
  const Pose T_before_behind = before.stored.T_map_cam.inverse() * behind.stored.T_map_cam;
  if (!agree(first->T_odom_cam.inverse() * second->T_odom_cam, T_before_behind)) return {};
  const double ties = 1.0 + (behind.linked_to - previous.sequence);
  return to.addEdge({previous, id, EdgeKind::kOdometry, T_before_behind, second->information / ties});
}

// The odometry edges that the messages tell of and the table does not.
Result<void> saveLostTies(const StoreSurvey& survey, MapStore& to) {
  Mapped mapped;
  for (const WholeKeyframe& keyframe : survey.keyframes)
    if (isMapped(keyframe)) mapped.emplace(keyframe.stored.id, &keyframe);
  for (const WholeKeyframe& keyframe : survey.keyframes) {
    const KeyframeId& id = keyframe.stored.id;
    const KeyframeId previous{id.robot, id.session, keyframe.linked_to};
    if (!keyframe.linked || keyframe.tied || !mapped.contains(id)) continue;
    if (!mapped.contains(previous)) {
      if (auto saved = saveTieAcrossGap(keyframe, mapped, to); !saved) return saved;
      continue;
    }
    const auto told = decoded(to, keyframe);
    if (!told) return told.error();
    if (auto added = to.addEdge({previous, id, EdgeKind::kOdometry, told->T_link_this, told->information}); !added)
      return added;
  }
  return {};
}

}  // namespace

Result<void> saveWhole(const StoreSurvey& survey, const std::string& path, bool copied) {
  const std::string absolute = std::filesystem::absolute(path).string();
  if (auto done = copyWholeRows(survey, absolute, copied); !done) return done;
  auto to = MapStore::open(absolute, MapStore::Mode::kOpen);
  if (!to) return to.error();
  auto transaction = to->begin();
  if (!transaction) return transaction.error();
  if (auto saved = saveMeta(survey, *to); !saved) return saved;
  if (auto saved = saveLostPoses(survey, *to); !saved) return saved;
  if (auto removed = to->removeClosuresOfNone(); !removed) return removed;
  if (auto saved = saveLostTies(survey, *to); !saved) return saved;
  return transaction->commit();
}

}  // namespace comap
