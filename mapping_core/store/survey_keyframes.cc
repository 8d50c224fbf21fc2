#include "mapping_core/store/survey_keyframes.h"

#include <algorithm>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "mapping_core/store/keyframe_runs.h"
#include "mapping_core/store/stray_messages.h"
#include "mapping_core/store/survey_rows.h"
#include "mapping_core/store/table_rows.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/codec/message_checksum.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

Error damagedRow(const std::string& text) { return {ErrorCode::kBadData, text}; }
Error mistyped() { return damagedRow("a value of it is of another type than its column"); }

// What the table of keyframes says of one message.
struct Description {
  KeyframeId id;
  int64_t bytes = 0, crc32 = 0;
};

// Of a query that stands on COMAP_KEYFRAME_ROW and its checksum.
Description descriptionOf(Query& row) {
  Description description;
  row.skip(1);  // its arrival
  description.id = row.keyframeId();
  row.skip(1);  // its stamp
  description.bytes = row.integer();
  description.crc32 = row.integer();
  return description;
}

std::map<int64_t, Description> readDescriptions(Database& database, StoreSurvey& survey, IndexEntries& entries) {
  std::map<int64_t, Description> result;
  const auto check = [&](int64_t arrival, Query& row) -> Result<void> {
    if (auto sound = checkRow(row, COMAP_KEYFRAME_TYPES); !sound) return sound;
    const Description description = descriptionOf(row);
    if (auto values = row.values(); !values) return values;
    result[arrival] = description;
    entries.keyframes.add(EntryHash().add(description.id).add(arrival));
    return {};
  };
  KeptRows kept;
  surveyTable(database, "row of keyframe", COMAP_TABLE_ROWS("keyframes", "arrival", COMAP_KEYFRAME_ROW ", checksum"),
              check, survey.damage, kept);
  if (!kept.all()) survey.descriptions.skip();
  if (!kept.inOrder()) survey.descriptions.leaveOrder();
  return result;
}

struct ReadKeyframe {
  WholeKeyframe whole;
  uint32_t skipped = 0;  // sequences before it that its robot never sent
};

// Against its checksum; a message whose row is lost must be readable to the last pixel.
Result<ReadKeyframe> readMessage(std::span<const uint8_t> message, const Description* description) {
  if (description != nullptr && messageChecksum(message) != description->crc32)
    return damagedRow(toString(description->id) + ", its message is damaged (checksum)");
  const auto keyframe = description != nullptr ? decodeKeyframeWithoutImages(message) : decodeKeyframe(message);
  if (!keyframe) return damagedRow("its message is damaged (" + keyframe.error().text + ")");
  if (description != nullptr && keyframe->id != description->id)
    return damagedRow("its row says " + toString(description->id) + ", its message " + toString(keyframe->id));
  ReadKeyframe read;
  StoredKeyframe& stored = read.whole.stored;
  stored.id = keyframe->id;
  stored.stamp_ns = keyframe->stamp_ns;
  stored.bytes = message.size();
  read.whole.linked = keyframe->linked;
  read.whole.linked_to = keyframe->linked_to;
  read.skipped = keyframe->skipped;
  return read;
}

// What is wrong with the description of a message that is whole; empty if nothing is.
std::string wrongIn(const Description* description, const StoredKeyframe& stored) {
  if (description == nullptr) return "its row is lost, its message is whole";
  if (description->bytes != static_cast<int64_t>(stored.bytes))
    return "its row says " + std::to_string(description->bytes) + " bytes, its message has " +
           std::to_string(stored.bytes);
  return "";
}

void readPoses(Database& database, StoreSurvey& survey) {
  std::unordered_map<int64_t, StoredKeyframe*> by_arrival;
  for (WholeKeyframe& keyframe : survey.keyframes) by_arrival[keyframe.stored.arrival] = &keyframe.stored;
  const auto check = [&](int64_t arrival, Query& row) -> Result<void> {
    if (auto sound = checkRow(row, COMAP_POSE_TYPES); !sound) return sound;
    row.skip(1);  // its keyframe
    const std::string map = row.text();
    const Pose pose = row.pose();
    if (auto values = row.values(); !values) return values;
    if (map.empty() || !pose.translation().allFinite()) return damagedRow("names no map, or a number of it is none");
    if (const auto keyframe = by_arrival.find(arrival); keyframe != by_arrival.end()) {
      keyframe->second->map = map;
      keyframe->second->T_map_cam = pose;
    }
    return {};
  };
  surveyTable(database, "pose of keyframe", COMAP_TABLE_ROWS("poses", "keyframe", COMAP_POSE_ROW ", checksum"), check,
              survey.damage, survey.poses);
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

// What SQLite did not come upon is among the keyframes now; all of them stand by their number again.
void addStrays(StoreSurvey& survey) {
  survey.damage.push_back(counted(survey.strays.size(), "message") +
                          " of keyframes to which no page leads any more: whole");
  survey.lost_keyframes -= std::min(survey.lost_keyframes, survey.strays.size());
  survey.messages.leaveOrder();
  std::sort(survey.keyframes.begin(), survey.keyframes.end(),
            [](const WholeKeyframe& a, const WholeKeyframe& b) { return a.stored.arrival < b.stored.arrival; });
  KeptRows descriptions;
  descriptions.leaveOrder();
  int64_t next = 0;
  for (const WholeKeyframe& keyframe : survey.keyframes) {
    if (keyframe.stored.arrival != next) descriptions.skip();
    next = int64_t{keyframe.stored.arrival} + 1;
    if (keyframe.described)
      descriptions.add(keyframe.stored.arrival);
    else
      descriptions.skip();
  }
  survey.descriptions = descriptions;
}

}  // namespace

void surveyKeyframes(Database& database, StoreSurvey& survey, IndexEntries& entries,
                     const std::function<void(size_t, size_t)>& progress) {
  const auto descriptions = readDescriptions(database, survey, entries);
  std::map<std::pair<std::string, uint64_t>, std::map<uint32_t, uint32_t>> skipped;
  std::unordered_set<int64_t> seen;
  KeyframeRuns ids;
  const auto take = [&](int64_t arrival, std::span<const uint8_t> message) -> Result<void> {
    const auto found = descriptions.find(arrival);
    const Description* description = found == descriptions.end() ? nullptr : &found->second;
    auto read = readMessage(message, description);
    if (!read) return read.error();
    StoredKeyframe& stored = read->whole.stored;
    if (arrival > std::numeric_limits<uint32_t>::max()) return damagedRow("expected a number below 4294967296");
    if (ids.contains(stored.id)) return damagedRow("is there twice: " + toString(stored.id));
    ids.add(stored.id);
    stored.arrival = static_cast<uint32_t>(arrival);
    skipped[{stored.id.robot, stored.id.session}][stored.id.sequence] = read->skipped;
    const std::string wrong = wrongIn(description, stored);
    read->whole.described = wrong.empty();
    if (wrong.empty())
      survey.descriptions.add(arrival);
    else
      survey.descriptions.skip();
    if (!wrong.empty()) survey.damage.push_back("keyframe " + toString(stored.id) + ": " + wrong);
    survey.keyframes.push_back(std::move(read->whole));
    return {};
  };
  const auto check = [&](int64_t arrival, Query& row) -> Result<void> {
    seen.insert(arrival);
    if (progress) progress(std::min(seen.size(), descriptions.size()), descriptions.size());
    return row.areOf("b") ? take(arrival, row.bytes()) : mistyped();
  };
  survey.lost_keyframes =
      surveyTable(database, "keyframe", COMAP_TABLE_ROWS("keyframe_messages", "keyframe", "encoded"), check,
                  survey.damage, survey.messages);
  std::map<int64_t, int64_t> missing;
  for (const auto& [arrival, description] : descriptions)
    if (!seen.contains(arrival)) missing[arrival] = description.bytes;
  if (!missing.empty())
    survey.strays = findStrays(survey.path, missing, [&](int64_t arrival, std::span<const uint8_t> message) {
      return bool(take(arrival, message));
    });
  if (!survey.strays.empty()) addStrays(survey);
  for (const auto& [arrival, description] : descriptions) {
    if (ids.contains(description.id) || seen.contains(arrival)) continue;
    survey.damage.push_back("keyframe " + toString(description.id) + ": its message is not there");
    survey.descriptions.skip();
  }
  // Where not even their number can be read, the rows that describe them tell it.
  survey.lost_keyframes =
      std::max(survey.lost_keyframes, descriptions.size() - std::min(descriptions.size(), survey.keyframes.size()));
  readPoses(database, survey);
  remarkGaps(skipped, survey);
}

Result<void> checkMessage(Database& database, int64_t arrival) {
  auto query = database.query("SELECT " COMAP_KEYFRAME_ROW
                              ", encoded FROM keyframes JOIN keyframe_messages ON keyframe = arrival "
                              "WHERE arrival = ?");
  if (!query) return query.error();
  const auto row = query->bind(arrival).step();
  if (!row) return row.error();
  if (!*row) return damagedRow("its message is not there");
  const Description description = descriptionOf(*query);
  const auto read = readMessage(query->bytes(), &description);
  if (!read) return read.error();
  if (const std::string wrong = wrongIn(&description, read->whole.stored); !wrong.empty()) return damagedRow(wrong);
  return query->values();
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
