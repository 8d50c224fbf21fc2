#include "mapping_core/store/schema.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>

namespace comap {
namespace {

// Images apart from poses: SQLite rewrites a whole row when one column changes.
constexpr const char* kTables = R"sql(
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;

CREATE TABLE robots (bit INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE) STRICT;

CREATE TABLE keyframes (
  arrival INTEGER PRIMARY KEY,
  robot TEXT NOT NULL REFERENCES robots (name),
  session INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  stamp_ns INTEGER NOT NULL,
  bytes INTEGER NOT NULL,
  crc32 INTEGER NOT NULL,
  UNIQUE (robot, session, sequence)
) STRICT;
CREATE TABLE keyframe_messages (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (arrival) ON DELETE CASCADE,
  encoded BLOB NOT NULL
) STRICT;
CREATE TABLE poses (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (arrival) ON DELETE CASCADE,
  map TEXT NOT NULL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL
) STRICT;

CREATE TABLE edges (
  number INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('odometry', 'loop', 'inter_robot', 'covisibility')),
  from_robot TEXT NOT NULL, from_session INTEGER NOT NULL, from_sequence INTEGER NOT NULL,
  to_robot TEXT NOT NULL, to_session INTEGER NOT NULL, to_sequence INTEGER NOT NULL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
  @INFORMATION@,
  merge INTEGER NOT NULL,         -- whose closure it is; 0: none
  withdrawn_by INTEGER NOT NULL,  -- the merge with whose undoing it went; 0: it holds
  UNIQUE (kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence)
) STRICT;

CREATE TABLE verdicts (
  number INTEGER PRIMARY KEY,
  query_robot TEXT NOT NULL, query_session INTEGER NOT NULL, query_sequence INTEGER NOT NULL,
  candidate_robot TEXT NOT NULL, candidate_session INTEGER NOT NULL, candidate_sequence INTEGER NOT NULL,
  accepted INTEGER NOT NULL,
  reason TEXT NOT NULL,
  fern_dissimilarity REAL, inlier_ratio REAL, rms_sigma REAL, degeneracy REAL, photometric_median REAL,
  seen_through REAL, unlike REAL, features REAL, round_trip_m REAL, round_trip_rad REAL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
  @INFORMATION@
) STRICT;
CREATE INDEX verdicts_by_reason ON verdicts (accepted, reason);

CREATE TABLE merges (
  number INTEGER PRIMARY KEY,
  kept TEXT NOT NULL,
  absorbed TEXT NOT NULL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
  keyframes_ingested INTEGER NOT NULL,
  undone TEXT NOT NULL,        -- why; empty: it holds
  undone_by INTEGER NOT NULL   -- the merge with whose undoing it went, itself or another; 0: it holds
) STRICT;
CREATE TABLE merge_robots (
  merge INTEGER NOT NULL REFERENCES merges (number) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  robot TEXT NOT NULL,
  PRIMARY KEY (merge, position)
) STRICT, WITHOUT ROWID;
CREATE TABLE merge_voters (
  merge INTEGER NOT NULL REFERENCES merges (number) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  robot TEXT NOT NULL, session INTEGER NOT NULL, sequence INTEGER NOT NULL,
  PRIMARY KEY (merge, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE tiles (
  number INTEGER PRIMARY KEY,
  map TEXT NOT NULL,
  x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  surfels INTEGER NOT NULL,
  zstd BLOB NOT NULL,
  UNIQUE (map, x, y, z)
) STRICT;
)sql";

// Partial: rows that are not of these cost nothing. An index of another shape is given another name, and the old one
// goes.
constexpr const char* kIndexes[] = {
    "DROP INDEX IF EXISTS main.edges_withdrawn",
    "CREATE INDEX IF NOT EXISTS main.edges_withdrawn_by_kind ON edges (withdrawn_by, kind) WHERE withdrawn_by <> 0",
    "CREATE INDEX IF NOT EXISTS main.edges_of_merges ON edges (merge) WHERE merge <> 0",
};

constexpr const char* kIndexNames[] = {"edges_withdrawn_by_kind", "edges_of_merges"};

std::string tables() {
  std::string information;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      information += (information.empty() ? "i" : ", i") + std::to_string(row) + std::to_string(column) + " REAL";
    }
  }
  constexpr std::string_view kMark = "@INFORMATION@";
  std::string sql = kTables;
  for (size_t at = sql.find(kMark); at != std::string::npos; at = sql.find(kMark)) {
    sql.replace(at, kMark.size(), information);
  }
  return sql;
}

// What is declared, and by which words.
Result<std::set<std::string>> declarations(Database& database) {
  auto query = database.query(
      "SELECT type || ' ' || name || ' ' || tbl_name || ' ' || coalesce(sql, '') "
      "FROM main.sqlite_schema");
  if (!query) return query.error();
  std::set<std::string> result;
  for (;;) {
    const auto row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    result.insert(query->text());
  }
}

std::string hex(int64_t value) {
  char text[32];
  std::snprintf(text, sizeof text, "0x%08llx", static_cast<unsigned long long>(value));
  return text;
}

}  // namespace

Result<void> createSchema(Database& database) {
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  // Another process may have been quicker between the check and the lock.
  const Result<bool> there = checkSchema(database);
  if (!there) return there.error();
  if (*there) return {};
  const std::string sql = tables() + "PRAGMA application_id = " + std::to_string(kStoreApplicationId) +
                          "; PRAGMA user_version = " + std::to_string(kStoreVersion) + ";";
  if (Result<void> made = database.execute(sql.c_str()); !made) return made;
  return transaction->commit();
}

Result<void> createIndexes(Database& database) {
  for (const char* sql : kIndexes)  // of one that is there, nothing is written
    if (Result<void> made = database.execute(sql); !made) return made;
  return {};
}

std::span<const char* const> indexNames() { return kIndexNames; }

Result<bool> checkSchema(Database& database) {
  const Result<int64_t> tables = database.integer("SELECT count(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  const Result<int64_t> application = database.integer("PRAGMA application_id");
  if (!application) return application.error();
  const Result<int64_t> version = database.integer("PRAGMA user_version");
  if (!version) return version.error();
  if (*tables == 0 && *application == 0 && *version == 0) return false;
  if (*application != kStoreApplicationId) {
    return Error{ErrorCode::kBadData, database.path() + ": a database of another application (application_id " +
                                          hex(*application) + ", expected " + hex(kStoreApplicationId) + ")"};
  }
  if (*version > kStoreVersion)
    return Error{ErrorCode::kBadData, database.path() + ": schema version " + std::to_string(*version) +
                                          " is newer than " + std::to_string(kStoreVersion) +
                                          ", the newest that this program reads: use a newer one"};
  if (*version < kFirstStoreVersion)
    return Error{ErrorCode::kBadData,
                 database.path() + ": schema version " + std::to_string(*version) + " is older than " +
                     std::to_string(kFirstStoreVersion) +
                     ", the oldest that this program reads; make the map again from the recordings"};
  return true;
}

Result<bool> isSchema(Database& database) {
  auto fresh = Database::open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!fresh) return fresh.error();
  if (auto created = createSchema(*fresh); !created) return created.error();
  const auto least = declarations(*fresh);
  if (!least) return least.error();
  if (auto created = createIndexes(*fresh); !created) return created.error();
  const auto most = declarations(*fresh);
  if (!most) return most.error();
  const auto found = declarations(database);
  if (!found) return found.error();
  const Result<int64_t> version = database.integer("PRAGMA user_version");
  if (!version) return version.error();
  return *version == kStoreVersion && std::includes(found->begin(), found->end(), least->begin(), least->end()) &&
         std::includes(most->begin(), most->end(), found->begin(), found->end());
}

Result<void> migrateSchema(Database& database, std::span<const Migration> steps, int64_t to) {
  const Result<int64_t> found = database.integer("PRAGMA user_version");
  if (!found) return found.error();
  if (*found == to) return {};
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  Result<int64_t> version = database.integer("PRAGMA user_version");
  if (!version) return version.error();
  for (; *version < to; ++*version) {
    const auto step =
        std::find_if(steps.begin(), steps.end(), [&](const Migration& one) { return one.from == *version; });
    if (step == steps.end())
      return Error{ErrorCode::kBadData, database.path() + ": schema version " + std::to_string(*version) +
                                            " cannot be brought to " + std::to_string(to)};
    if (auto done = database.execute(step->sql); !done) return done;
    const std::string next = "PRAGMA user_version = " + std::to_string(*version + 1);
    if (auto done = database.execute(next.c_str()); !done) return done;
  }
  return transaction->commit();
}

std::span<const Migration> storeMigrations() { return {}; }  // {3, "ALTER TABLE ..."} and so on, once there is a 4

}  // namespace comap
