#include "edge_agent/uplink/outbox_wreck.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "edge_agent/uplink/outbox_rows.h"
#include "protocol/codec/limits.h"
#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

// Places in a row that cannot be read before nothing more is looked for: many times what one page is the way to.
constexpr int kMostTried = 20000;

}  // namespace

Result<OutboxWreck> OutboxWreck::survey(const std::string& path) {
  auto database = Database::open(path, SQLITE_OPEN_READWRITE);
  if (!database) return database.error();
  OutboxWreck wreck(std::move(*database));
  wreck.database_.bearDamage();
  for (const char* pragma : {"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA cell_size_check = ON"})
    if (auto set = wreck.database_.execute(pragma); !set) return set.error();
  if (const auto tables = wreck.database_.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'messages'");
      !tables || *tables != 1)
    return Error{ErrorCode::kBadData, path + ": its list of tables cannot be read"};
  wreck.surveyMessages();
  wreck.surveyRows();
  wreck.surveyLeaves();
  const auto last = wreck.database_.integer("SELECT value FROM meta WHERE key = 'session'");
  if (last) wreck.last_session_ = static_cast<uint64_t>(std::max<int64_t>(0, *last));
  for (const auto& [key, keyframe] : wreck.keyframes_) wreck.last_session_ = std::max(wreck.last_session_, key.session);
  return wreck;
}

void OutboxWreck::surveyMessages() {
  int64_t at = 1;
  for (int tried = 0; tried < kMostTried;) {
    auto query = database_.query(
        "SELECT rowid, session, sequence FROM messages NOT INDEXED WHERE rowid >= ? ORDER BY rowid LIMIT 1");
    const Result<bool> row = query ? query->bind(at).step() : query.error();
    if (!row) {
      holes_ = true;
      ++tried;
      ++at;
      continue;
    }
    if (!*row) return;
    tried = 0;
    const bool whole = query->areOf("iii");
    const int64_t number = query->integer();
    const auto session = static_cast<uint64_t>(query->integer());
    const uint32_t sequence = query->unsigned32();
    if (whole && query->values()) keyframes_[{session, sequence}].message = number;
    query->forgive();
    if (number == std::numeric_limits<int64_t>::max()) return;
    at = std::max(at, number) + 1;
  }
}

// In the file's own order and numbers, which damage may have made any.
void OutboxWreck::surveyRows() {
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  int64_t session = 0, sequence = 0;
  for (int tried = 0;;) {
    auto query = database_.query("SELECT session, sequence, crc32, " COMAP_OUTBOX_ROW_COLUMNS
                                 " FROM keyframes WHERE (session, sequence) >= (?, ?) "
                                 "ORDER BY session, sequence LIMIT 1");
    const Result<bool> row = query ? query->bind(session).bind(sequence).step() : query.error();
    if (row && !*row) return;
    if (row) {
      tried = 0;
      session = query->integer();
      sequence = query->integer();
      takeRow(*query);
    } else {
      rows_have_holes_ = holes_ = true;
      ++tried;
    }
    const bool next_session = tried == kMostTried || sequence == kMost;
    if (next_session && session == kMost) return;
    if (next_session) session = row ? session + 1 : sessionBehind(session);
    if (next_session && session == 0) return;
    sequence = next_session ? 0 : sequence + 1;
    if (next_session) tried = 0;
  }
}

void OutboxWreck::takeRow(Query& query) {
  const uint32_t checksum = query.unsigned32();
  const OutboxRow row = rowOf(query);
  if (query.values()) {
    keyframes_[row.key].row = row;
    keyframes_[row.key].checksum = checksum;
  } else {
    rows_have_holes_ = holes_ = true;
  }
  query.forgive();
}

// The next one of which a message is known; 0: none.
int64_t OutboxWreck::sessionBehind(int64_t session) const {
  const auto next = keyframes_.upper_bound({static_cast<uint64_t>(session), std::numeric_limits<uint32_t>::max()});
  if (next == keyframes_.end()) return 0;
  return std::max<int64_t>(0, static_cast<int64_t>(next->first.session));
}

// Messages that no tree leads to. Leaves that were given back hold what the core has by now, or what was packed
// tighter: where the rows tell what is left, theirs alone count.
void OutboxWreck::surveyLeaves() {
  const bool complete = !holes_ && std::all_of(keyframes_.begin(), keyframes_.end(),
                                               [](const auto& entry) { return entry.second.message.has_value(); });
  if (complete) return;
  using Kind = LeafRow::Column::Kind;
  (void)bool(database_.execute("PRAGMA wal_checkpoint(TRUNCATE)"));  // into the file, which is read past SQLite now
  if (auto opened = LeafRows::open(database_.path())) leaves_.emplace(std::move(*opened));
  if (!leaves_) return;
  leaves_->each([this](const LeafRow& row) {
    const auto& columns = row.columns;
    if (columns.size() != 3 || columns[0].kind != Kind::kInteger || columns[1].kind != Kind::kInteger ||
        columns[2].kind != Kind::kBlob || columns[2].size > kMaxLargeMessageBytes ||
        !std::in_range<uint32_t>(columns[1].integer))
      return;
    const OutboxKey key{static_cast<uint64_t>(columns[0].integer), static_cast<uint32_t>(columns[1].integer)};
    if (!rows_have_holes_ && !keyframes_.contains(key)) return;
    Keyframe& keyframe = keyframes_[key];
    if (!keyframe.message) keyframe.leaves.push_back(row);
  });
}

std::optional<std::vector<uint8_t>> OutboxWreck::storedMessage(int64_t number) {
  auto query = database_.query("SELECT encoded FROM messages NOT INDEXED WHERE rowid = ?");
  const Result<bool> row = query ? query->bind(number).step() : query.error();
  if (!row || !*row) return std::nullopt;
  const auto bytes = query->bytes();
  return std::vector<uint8_t>(bytes.begin(), bytes.end());
}

std::optional<std::vector<uint8_t>> OutboxWreck::messageOf(const OutboxKey& key) {
  const Keyframe& known = keyframes_.at(key);
  const auto isWhole = [&](const std::optional<std::vector<uint8_t>>& bytes) {
    if (!bytes) return false;
    if (known.row) return messageChecksum(*bytes) == known.checksum;
    const auto keyframe = decodeKeyframe(*bytes);
    return keyframe && OutboxKey{keyframe->id.session, keyframe->id.sequence} == key;
  };
  if (known.message)
    if (auto bytes = storedMessage(*known.message); isWhole(bytes)) return bytes;
  for (const LeafRow& leaf : known.leaves)
    if (auto bytes = leaves_->blob(leaf, 2); isWhole(bytes)) return bytes;
  return std::nullopt;
}

}  // namespace comap
