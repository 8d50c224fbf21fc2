// The part of Outbox that is about its file as a whole: its form, whose it is, and the sessions it has given.
#include <algorithm>

#include "edge_agent/uplink/outbox.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

constexpr int64_t kApplicationId = 0x434d4f42;  // "CMOB"
constexpr int64_t kVersion = 1;

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
  if (auto ran = query->bind(static_cast<int64_t>(session)).run(); !ran) return ran.error();
  if (auto set = database_.execute("PRAGMA synchronous = NORMAL"); !set) return set.error();
  return session;
}

}  // namespace comap
