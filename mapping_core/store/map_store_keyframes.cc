// Keyframes and their poses.
#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/table_rows.h"
#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

// The contributor bit of the robot: its place in the order of first arrival.
Result<void> registerRobot(Database& database, const std::string& robot) {
  Result<Query> query = database.query(
      "INSERT INTO robots (bit, name) SELECT count(*), ?1 FROM robots WHERE true ON CONFLICT (name) DO NOTHING");
  if (!query) return query.error();
  return query->bind(robot).run();
}

// Of COMAP_POSE_ROW and its checksum.
void readPose(Query& query, StoredKeyframe& keyframe) {
  const RowState state = query.rowState(COMAP_POSE_TYPES);
  const int64_t arrival = query.integer();
  keyframe.map = query.text();
  const Pose T_map_cam = query.pose();
  if (!keyframe.map.empty()) keyframe.T_map_cam = T_map_cam;
  query.judged(state, "pose of keyframe", arrival);
}

}  // namespace

Result<bool> MapStore::addKeyframe(const KeyframeId& id, int64_t stamp_ns, std::span<const uint8_t> encoded) {
  Database& database = state_->database;
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  if (Result<void> registered = registerRobot(database, id.robot); !registered) return registered.error();

  Result<Query> row = database.query(
      "INSERT INTO keyframes (arrival, robot, session, sequence, stamp_ns, bytes, crc32) "
      "SELECT coalesce(max(arrival) + 1, 0), ?, ?, ?, ?, ?, ? FROM keyframes WHERE true "
      "ON CONFLICT (robot, session, sequence) DO NOTHING");
  if (!row) return row.error();
  row->bind(id).bind(stamp_ns).bind(static_cast<int64_t>(encoded.size())).bind(int64_t{messageChecksum(encoded)});
  if (Result<void> ran = row->run(); !ran) return ran.error();
  if (database.changes() == 0) return false;  // rolled back: nothing to write

  Result<Query> message = database.query(
      "INSERT INTO keyframe_messages (keyframe, encoded) SELECT arrival, ?4 FROM keyframes "
      "WHERE robot = ?1 AND session = ?2 AND sequence = ?3");
  if (!message) return message.error();
  if (Result<void> ran = message->bind(id).bind(encoded).run(); !ran) return ran.error();
  if (Result<void> committed = transaction->commit(); !committed) return committed.error();
  return true;
}

Result<std::vector<StoredKeyframe>> MapStore::keyframes() const {
  Result<Query> query =
      state_->database.query("SELECT " COMAP_KEYFRAME_ROW ", keyframes.checksum, " COMAP_POSE_ROW
                             ", poses.checksum FROM keyframes LEFT JOIN poses ON keyframe = arrival ORDER BY arrival");
  if (!query) return query.error();
  std::vector<StoredKeyframe> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    const RowState state = query->rowState(COMAP_KEYFRAME_TYPES);
    StoredKeyframe keyframe;
    keyframe.arrival = query->unsigned32();
    keyframe.id = query->keyframeId();
    keyframe.stamp_ns = query->integer();
    keyframe.bytes = query->unsigned32();
    query->skip(2);  // the message's checksum, and the row's
    if (query->areOf("i")) readPose(*query, keyframe);
    query->judged(state, "row of keyframe", keyframe.arrival);
    result.push_back(std::move(keyframe));
  }
}

Result<std::vector<KeyframeId>> MapStore::mappedKeyframes() const {
  Result<Query> query = state_->database.query("SELECT " COMAP_KEYFRAME_ROW
                                               ", checksum FROM keyframes WHERE arrival IN (SELECT keyframe FROM "
                                               "poses WHERE map <> '') ORDER BY arrival");
  if (!query) return query.error();
  std::vector<KeyframeId> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    const RowState state = query->rowState(COMAP_KEYFRAME_TYPES);
    const int64_t arrival = query->integer();
    result.push_back(query->keyframeId());
    query->judged(state, "row of keyframe", arrival);
  }
}

Result<std::vector<uint8_t>> MapStore::encodedKeyframe(const KeyframeId& id) const {
  Result<Query> query = state_->database.query(
      "SELECT crc32, encoded FROM keyframes JOIN keyframe_messages ON keyframe = arrival "
      "WHERE robot = ? AND session = ? AND sequence = ?");
  if (!query) return query.error();
  const Result<bool> row = query->bind(id).step();
  if (!row) return row.error();
  const std::string& path = state_->database.path();
  if (!*row) return Error{ErrorCode::kWrongUse, path + ": holds no keyframe " + toString(id)};
  const int64_t expected = query->integer();
  const std::span<const uint8_t> bytes = query->bytes();
  if (messageChecksum(bytes) != expected) {
    return Error{ErrorCode::kBadData, path + ": keyframe " + toString(id) + " is damaged: its checksum is " +
                                          std::to_string(messageChecksum(bytes)) + ", expected " +
                                          std::to_string(expected)};
  }
  return std::vector<uint8_t>(bytes.begin(), bytes.end());
}

Result<void> MapStore::setPoses(const MapId& map, const std::map<KeyframeId, Pose>& T_map_cam) {
  Database& database = state_->database;
  if (map.empty()) return Error{ErrorCode::kWrongUse, database.path() + ": a map's name must not be empty"};
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  for (const auto& [id, pose] : T_map_cam) {
    Result<Query> query = database.query(
        "INSERT INTO poses (keyframe, map, qx, qy, qz, qw, tx, ty, tz) "
        "SELECT arrival, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11 FROM keyframes "
        "WHERE robot = ?1 AND session = ?2 AND sequence = ?3 "
        "ON CONFLICT (keyframe) DO UPDATE SET map = excluded.map, qx = excluded.qx, qy = excluded.qy, "
        "qz = excluded.qz, qw = excluded.qw, tx = excluded.tx, ty = excluded.ty, tz = excluded.tz");
    if (!query) return query.error();
    if (Result<void> ran = query->bind(id).bind(map).bind(pose).run(); !ran) return ran;
    if (database.changes() == 0) {
      return Error{ErrorCode::kWrongUse, database.path() + ": holds no keyframe " + toString(id) + " to give a pose"};
    }
  }
  return transaction->commit();
}

}  // namespace comap
