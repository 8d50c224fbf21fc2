#include "mapping_core/store/survey_keyframes.h"

#include <zlib.h>

#include <algorithm>
#include <set>

#include "mapping_core/store/survey_rows.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

Error damagedRow(const std::string& text) { return {ErrorCode::kBadData, text}; }

// What the table of keyframes says of one message.
struct Description {
  KeyframeId id;
  int64_t crc32 = 0;
};

std::map<int64_t, Description> readDescriptions(Database& database, StoreSurvey& survey) {
  std::map<int64_t, Description> result;
  const auto check = [&](Query& row) -> Result<void> {
    const int64_t arrival = row.integer();
    Description description;
    description.id = row.keyframeId();
    description.crc32 = row.integer();
    if (auto values = valuesOf(row); !values) return values;
    result[arrival] = description;
    return {};
  };
  surveyTable(database, "row of keyframe", "SELECT coalesce(max(arrival), 0) FROM keyframes",
              "SELECT arrival, robot, session, sequence, crc32 FROM keyframes WHERE arrival = ?", check, survey.damage);
  return result;
}

// Against its checksum; a message whose row is lost must be readable to the last pixel.
Result<StoredKeyframe> wholeKeyframe(std::span<const uint8_t> message, const Description* description) {
  if (description != nullptr && crc32_z(0, message.data(), message.size()) != static_cast<uLong>(description->crc32))
    return damagedRow(toString(description->id) + ", its message is damaged (checksum)");
  const auto keyframe = description != nullptr ? decodeKeyframeWithoutImages(message) : decodeKeyframe(message);
  if (!keyframe) return damagedRow("its message is damaged (" + keyframe.error().text + ")");
  if (description != nullptr && keyframe->id != description->id)
    return damagedRow("its row says " + toString(description->id) + ", its message " + toString(keyframe->id));
  StoredKeyframe stored;
  stored.id = keyframe->id;
  stored.stamp_ns = keyframe->stamp_ns;
  stored.bytes = message.size();
  return stored;
}

void readPoses(Database& database, StoreSurvey& survey) {
  std::map<int64_t, StoredKeyframe*> by_arrival;
  for (StoredKeyframe& keyframe : survey.keyframes) by_arrival[keyframe.arrival] = &keyframe;
  const auto check = [&](Query& row) -> Result<void> {
    const int64_t arrival = row.integer();
    const std::string map = row.text();
    const Pose pose = row.pose();
    if (auto values = valuesOf(row); !values) return values;
    if (map.empty() || !pose.translation().allFinite()) return damagedRow("names no map, or a number of it is none");
    if (const auto keyframe = by_arrival.find(arrival); keyframe != by_arrival.end()) {
      keyframe->second->map = map;
      keyframe->second->T_map_cam = pose;
    }
    return {};
  };
  surveyTable(database, "pose of keyframe", "SELECT coalesce(max(keyframe), 0) FROM poses",
              "SELECT keyframe, map, qx, qy, qz, qw, tx, ty, tz FROM poses WHERE keyframe = ?", check, survey.damage);
}

// Sequences that are neither there nor were skipped by their robot.
void remarkGaps(const std::map<std::pair<std::string, uint64_t>, std::map<uint32_t, uint32_t>>& skipped,
                StoreSurvey& survey) {
  for (const auto& [chain, sequences] : skipped) {
    uint64_t next = 0;
    for (const auto& [sequence, before] : sequences) {
      if (sequence > next + before)
        survey.remarks.push_back("robot " + chain.first + ", session " + std::to_string(chain.second) + ": sequences " +
                                 std::to_string(next) + " to " + std::to_string(sequence - before - 1) +
                                 " are not there: lost here, or not yet delivered");
      next = uint64_t{sequence} + 1;
    }
  }
}

}  // namespace

void surveyKeyframes(Database& database, StoreSurvey& survey) {
  const auto descriptions = readDescriptions(database, survey);
  std::map<std::pair<std::string, uint64_t>, std::map<uint32_t, uint32_t>> skipped;
  std::set<int64_t> seen;
  std::set<KeyframeId> ids;
  const auto check = [&](Query& row) -> Result<void> {
    const int64_t arrival = row.integer();
    seen.insert(arrival);
    const auto message = row.bytes();
    const auto description = descriptions.find(arrival);
    auto stored = wholeKeyframe(message, description == descriptions.end() ? nullptr : &description->second);
    if (!stored) return stored.error();
    if (!ids.insert(stored->id).second) return damagedRow("is there twice: " + toString(stored->id));
    stored->arrival = static_cast<uint32_t>(arrival);
    const auto head = decodeKeyframeWithoutImages(message);
    if (head) skipped[{stored->id.robot, stored->id.session}][stored->id.sequence] = head->skipped;
    if (description == descriptions.end())
      survey.damage.push_back("keyframe " + toString(stored->id) + ": its row is lost, its message is whole");
    survey.keyframes.push_back(std::move(*stored));
    return {};
  };
  survey.lost_keyframes =
      surveyTable(database, "keyframe", "SELECT coalesce(max(keyframe), 0) FROM keyframe_messages",
                  "SELECT keyframe, encoded FROM keyframe_messages WHERE keyframe = ?", check, survey.damage);
  for (const auto& [arrival, description] : descriptions) {
    if (ids.contains(description.id) || seen.contains(arrival)) continue;
    survey.damage.push_back("keyframe " + toString(description.id) + ": its message is not there");
  }
  readPoses(database, survey);
  remarkGaps(skipped, survey);
}

Result<std::vector<uint8_t>> messageOf(Database& database, uint32_t arrival) {
  auto query = database.query("SELECT encoded FROM keyframe_messages WHERE keyframe = ?");
  if (!query) return query.error();
  const auto row = query->bind(int64_t{arrival}).step();
  if (!row) return row.error();
  if (!*row) return Error{ErrorCode::kBadData, database.path() + ": keyframe " + std::to_string(arrival) + " is gone"};
  const auto bytes = query->bytes();
  return std::vector<uint8_t>(bytes.begin(), bytes.end());
}

}  // namespace comap
