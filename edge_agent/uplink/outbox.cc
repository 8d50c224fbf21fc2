#include "edge_agent/uplink/outbox.h"

#include <algorithm>
#include <tuple>

#include "edge_agent/uplink/outbox_rows.h"
#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

constexpr int64_t kApplicationId = 0x434d4f42;  // "CMOB"
constexpr int64_t kVersion = 1;
constexpr int64_t kBytesBeside = 1024;  // a row's share of the file besides its message

// Messages apart from what is known of them: SQLite reads and writes whole rows.
constexpr const char* kTables = R"sql(
CREATE TABLE meta (key TEXT PRIMARY KEY, value INTEGER NOT NULL) STRICT, WITHOUT ROWID;
CREATE TABLE keyframes (
  session INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  bytes INTEGER NOT NULL,
  crc32 INTEGER NOT NULL,
  sent INTEGER NOT NULL,
  thinned INTEGER NOT NULL,
  skipped INTEGER NOT NULL,
  linked INTEGER NOT NULL,
  linked_to INTEGER NOT NULL,
  odom_qx REAL, odom_qy REAL, odom_qz REAL, odom_qw REAL, odom_tx REAL, odom_ty REAL, odom_tz REAL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
  information BLOB NOT NULL,
  PRIMARY KEY (session, sequence)
) STRICT, WITHOUT ROWID;
CREATE INDEX to_thin ON keyframes (session, sequence) WHERE thinned = 0 AND sent = 0;
CREATE INDEX by_link ON keyframes (session, linked_to) WHERE linked = 1;
CREATE TABLE messages (
  session INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  encoded BLOB NOT NULL,
  UNIQUE (session, sequence)
) STRICT;
)sql";

int64_t signedOf(uint64_t session) { return static_cast<int64_t>(session); }

std::span<const uint8_t> bytesOf(const Matrix6d& matrix) {
  return {reinterpret_cast<const uint8_t*>(matrix.data()), sizeof(double) * 36};
}

Result<std::vector<OutboxRow>> rowsOf(Query& query) {
  std::vector<OutboxRow> rows;
  for (;;) {
    const auto row = query.step();
    if (!row) return row.error();
    if (!*row) return rows;
    rows.push_back(rowOf(query));
  }
}

Query& bind(Query& query, const OutboxKey& key) {
  return query.bind(signedOf(key.session)).bind(int64_t{key.sequence});
}

Error withAdvice(Error error) {
  if (error.text.find("locked") != std::string::npos)
    error.text +=
        "; another edge_agent of this robot is running here: stop it, or give this one another name or outbox";
  return error;
}

}  // namespace

Result<Outbox> Outbox::open(const std::string& path) {
  auto database = Database::open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!database) return database.error();
  Outbox outbox(std::move(*database));
  if (auto prepared = outbox.prepare(); !prepared) return withAdvice(prepared.error());
  return outbox;
}

Result<Outbox> Outbox::inMemory() { return open(":memory:"); }

Result<void> Outbox::prepare() {
  // Locked as long as it is open: two agents of one name would send each other's keyframes and delete them.
  for (const char* pragma :
       {"PRAGMA busy_timeout = 500", "PRAGMA locking_mode = EXCLUSIVE", "PRAGMA auto_vacuum = INCREMENTAL",
        "PRAGMA journal_mode = WAL", "PRAGMA synchronous = NORMAL", "PRAGMA journal_size_limit = 8000000"}) {
    if (auto set = database_.execute(pragma); !set) return set;
  }
  auto transaction = Transaction::begin(database_);
  if (!transaction) return transaction.error();
  const auto tables = database_.integer("SELECT count(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  const auto application = database_.integer("PRAGMA application_id");
  if (!application) return application.error();
  const auto version = database_.integer("PRAGMA user_version");
  if (!version) return version.error();
  if (*tables == 0 && *application == 0) {
    const std::string sql = kTables + ("PRAGMA application_id = " + std::to_string(kApplicationId)) +
                            "; PRAGMA user_version = " + std::to_string(kVersion) + ";";
    if (auto made = database_.execute(sql.c_str()); !made) return made;
  } else if (*application != kApplicationId || *version != kVersion) {
    return Error{ErrorCode::kWrongUse, path() + ": is no outbox of this version (application " +
                                           std::to_string(*application) + ", version " + std::to_string(*version) +
                                           "): name another outbox.directory, or move this file away"};
  }
  if (auto committed = transaction->commit(); !committed) return committed;
  if (auto counted = countAll(); !counted) return counted;
  const auto read = lastSession();  // damage there shows now, not when the session begins
  return read ? Result<void>() : read.error();
}

Result<void> Outbox::belongTo(const std::string& robot) {
  // As a key: values are numbers, in the files of all releases.
  constexpr std::string_view kOwner = "robot:";
  auto query = database_.query("SELECT key FROM meta WHERE key >= 'robot:' AND key < 'robot;'");
  if (!query) return query.error();
  const auto told = query->step();
  if (!told) return told.error();
  std::string owner = *told ? query->text().substr(kOwner.size()) : "";
  const bool known = *told;
  if (!known && !keyframes_.empty()) {
    const auto row = firstFrom(keyframes_.begin()->first, 0);
    if (!row) return row.error();
    const auto message = *row ? encoded((*row)->key) : Error{};
    const auto head = message ? decodeKeyframeId(*message) : message.error();
    if (head) owner = head->id.robot;
  }
  if (!owner.empty() && owner != robot)
    return Error{ErrorCode::kWrongUse, path() + ": is the outbox of robot '" + owner + "', this is robot '" + robot +
                                           "': name another outbox.directory, or move this file away"};
  if (known) return {};
  auto insert = database_.query("INSERT INTO meta (key, value) VALUES (?, 1)");
  if (!insert) return insert.error();
  return insert->bind(std::string(kOwner) + robot).run();
}

Result<void> Outbox::countAll() {
  auto query = database_.query("SELECT session, count(*), sum(bytes) FROM keyframes GROUP BY session");
  if (!query) return query.error();
  keyframes_.clear();
  bytes_ = 0;
  for (;;) {
    const auto row = query->step();
    if (!row) return row.error();
    if (!*row) return {};
    const auto session = static_cast<uint64_t>(query->integer());
    const auto keyframes = query->integer();
    const auto bytes = query->integer();
    keyframes_[session] = static_cast<size_t>(keyframes);
    bytes_ += static_cast<uint64_t>(bytes + keyframes * kBytesBeside);
  }
}

Result<Outbox::Change> Outbox::begin() {
  auto transaction = Transaction::begin(database_);
  if (!transaction) return transaction.error();
  return Change(*this, std::move(*transaction));
}

Outbox::Change::Change(Outbox& outbox, Transaction transaction)
    : outbox_(outbox), transaction_(std::move(transaction)), before_({outbox.keyframes_, outbox.bytes_}) {}

Outbox::Change::~Change() {
  if (before_) std::tie(outbox_.keyframes_, outbox_.bytes_) = *before_;
}

Result<void> Outbox::Change::commit() {
  auto committed = transaction_.commit();
  if (committed) before_.reset();
  return committed;
}

Result<uint64_t> Outbox::lastSession() {
  const auto last = database_.integer(
      "SELECT max(coalesce((SELECT value FROM meta WHERE key = 'session'), 0), "
      "coalesce((SELECT max(session) FROM keyframes), 0))");
  if (!last) return last.error();
  return static_cast<uint64_t>(*last);
}

Result<uint64_t> Outbox::beginSession(uint64_t wished) {
  const auto last = lastSession();
  if (!last) return last.error();
  const uint64_t session = std::max(wished, *last + 1);
  // A power cut must not bring the number back: this one write waits for the disk.
  if (auto set = database_.execute("PRAGMA synchronous = FULL"); !set) return set.error();
  auto query =
      database_.query("INSERT INTO meta (key, value) VALUES ('session', ?1) ON CONFLICT DO UPDATE SET value = ?1");
  if (!query) return query.error();
  if (auto ran = query->bind(signedOf(session)).run(); !ran) return ran.error();
  if (auto set = database_.execute("PRAGMA synchronous = NORMAL"); !set) return set.error();
  return session;
}

void Outbox::count(uint64_t session, int keyframes, int64_t bytes) {
  auto& held = keyframes_[session];
  held += static_cast<size_t>(keyframes);
  if (held == 0) keyframes_.erase(session);
  bytes_ += static_cast<uint64_t>(bytes + keyframes * kBytesBeside);
}

Result<void> Outbox::add(const OutboxRow& row, std::span<const uint8_t> encoded) {
  auto change = begin();
  if (!change) return change.error();
  auto known = database_.query("INSERT INTO keyframes (" COMAP_OUTBOX_ROW_COLUMNS
                               ", crc32) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  if (!known) return known.error();
  bind(*known, row.key).bind(static_cast<int64_t>(encoded.size())).bind(int64_t{row.sent}).bind(int64_t{row.thinned});
  known->bind(int64_t{row.skipped}).bind(int64_t{row.link.linked}).bind(int64_t{row.link.linked_to});
  known->bind(row.T_odom_cam).bind(row.link.T_link_this).bind(bytesOf(row.link.information));
  if (auto ran = known->bind(int64_t{messageChecksum(encoded)}).run(); !ran) return ran;
  auto message = database_.query("INSERT INTO messages (session, sequence, encoded) VALUES (?, ?, ?)");
  if (!message) return message.error();
  if (auto ran = bind(*message, row.key).bind(encoded).run(); !ran) return ran;
  count(row.key.session, 1, static_cast<int64_t>(encoded.size()));
  return change->commit();
}

Result<std::vector<uint8_t>> Outbox::encoded(const OutboxKey& key) {
  auto query = database_.query(
      "SELECT crc32, encoded FROM messages JOIN keyframes USING (session, sequence) WHERE session = ? AND sequence = "
      "?");
  if (!query) return query.error();
  const auto row = bind(*query, key).step();
  if (!row) return row.error();
  const std::string name = path() + ": keyframe " + std::to_string(key.session) + "/" + std::to_string(key.sequence);
  if (!*row) return Error{ErrorCode::kProblem, name + " is not there"};
  const uint32_t expected = query->unsigned32();
  const auto bytes = query->bytes();
  if (messageChecksum(bytes) != expected) return Error{ErrorCode::kBadData, name + " is damaged"};
  return std::vector<uint8_t>(bytes.begin(), bytes.end());
}

Result<std::optional<OutboxRow>> Outbox::firstFrom(uint64_t session, uint32_t from) {
  auto found = rows(session, from, 1);
  if (!found) return found.error();
  return found->empty() ? std::optional<OutboxRow>() : std::optional(found->front());
}

Result<std::vector<OutboxRow>> Outbox::rows(uint64_t session, uint32_t from, size_t most) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? AND sequence >= ? ORDER BY sequence LIMIT ?");
  if (!query) return query.error();
  bind(*query, {session, from}).bind(static_cast<int64_t>(most));
  return rowsOf(*query);
}

Result<std::optional<OutboxRow>> Outbox::last(uint64_t session) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? ORDER BY sequence DESC LIMIT 1");
  if (!query) return query.error();
  const auto found = rowsOf(query->bind(signedOf(session)));
  if (!found) return found.error();
  return found->empty() ? std::optional<OutboxRow>() : std::optional(found->front());
}

Result<std::vector<OutboxRow>> Outbox::linkedTo(const OutboxKey& key) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? AND linked_to = ? AND linked = 1 ORDER BY sequence");
  if (!query) return query.error();
  return rowsOf(bind(*query, key));
}

Result<std::optional<OutboxRow>> Outbox::oldestUnthinned() {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE thinned = 0 AND sent = 0 ORDER BY session, sequence LIMIT 1");
  if (!query) return query.error();
  const auto row = query->step();
  if (!row) return row.error();
  return *row ? std::optional(rowOf(*query)) : std::optional<OutboxRow>();
}

Result<void> Outbox::markSent(const OutboxKey& key) {
  auto query = database_.query("UPDATE keyframes SET sent = 1 WHERE session = ? AND sequence = ? AND sent = 0");
  if (!query) return query.error();
  return bind(*query, key).run();
}

Result<void> Outbox::replace(const OutboxRow& row, std::span<const uint8_t> encoded) {
  auto change = begin();
  if (!change) return change.error();
  if (auto removed = remove(row.key); !removed) return removed;
  if (auto added = add(row, encoded); !added) return added;
  return change->commit();
}

Result<void> Outbox::remove(const OutboxKey& key) {
  auto change = begin();
  if (!change) return change.error();
  auto size = database_.query("SELECT bytes FROM keyframes WHERE session = ? AND sequence = ?");
  if (!size) return size.error();
  const auto there = bind(*size, key).step();
  if (!there) return there.error();
  if (!*there) return {};
  const int64_t bytes = size->integer();
  for (const char* sql : {"DELETE FROM keyframes WHERE session = ? AND sequence = ?",
                          "DELETE FROM messages WHERE session = ? AND sequence = ?"}) {
    auto query = database_.query(sql);
    if (!query) return query.error();
    if (auto ran = bind(*query, key).run(); !ran) return ran;
  }
  count(key.session, -1, -bytes);
  return change->commit();
}

Result<std::vector<OutboxKey>> Outbox::acknowledge(const Acknowledgement& acknowledgement) {
  std::vector<OutboxKey> held;
  if (size(acknowledgement.session) == 0 || !acknowledgement.refusal.empty()) return held;
  auto change = begin();
  if (!change) return change.error();
  auto below = database_.query("SELECT sequence FROM keyframes WHERE session = ? AND sequence < ?");
  if (!below) return below.error();
  bind(*below, {acknowledgement.session, acknowledgement.next_expected});
  for (;;) {
    const auto row = below->step();
    if (!row) return row.error();
    if (!*row) break;
    held.push_back({acknowledgement.session, below->unsigned32()});
  }
  for (const uint32_t sequence : acknowledgement.also_held) held.push_back({acknowledgement.session, sequence});
  const uint64_t bytes_before = bytes_;
  for (const OutboxKey& key : held)
    if (auto removed = remove(key); !removed) return removed.error();
  if (auto committed = change->commit(); !committed) return committed.error();
  // Once all is delivered the file gives its room back.
  if (bytes_ == 0 && bytes_before > 0)
    if (auto shrunk = database_.execute("PRAGMA incremental_vacuum"); !shrunk) return shrunk.error();
  return held;
}

Result<void> Outbox::limitBytes(uint64_t bytes) {
  const auto page = database_.integer("PRAGMA page_size");
  if (!page) return page.error();
  const std::string sql = "PRAGMA max_page_count = " + std::to_string(bytes / static_cast<uint64_t>(*page));
  return database_.execute(sql.c_str());
}

size_t Outbox::size() const {
  size_t all = 0;
  for (const auto& [session, keyframes] : keyframes_) all += keyframes;
  return all;
}

size_t Outbox::size(uint64_t session) const {
  const auto found = keyframes_.find(session);
  return found == keyframes_.end() ? 0 : found->second;
}

std::vector<uint64_t> Outbox::sessions() const {
  std::vector<uint64_t> sessions;
  for (const auto& [session, keyframes] : keyframes_) sessions.push_back(session);
  return sessions;
}

}  // namespace comap
