#include "mapping_core/store/schema.h"

#include <algorithm>
#include <cassert>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <set>
#include <string>

#include "mapping_core/store/packed_numbers.h"
#include "mapping_core/store/schema_3.h"
#include "mapping_core/store/table_rows.h"

namespace comap {
namespace {

#define COMAP_CHECKSUM(row) "  checksum INTEGER NOT NULL AS (row_sum(" row ")) STORED"

struct Words {
  const char* name;
  const char* sql;
};

// Images apart from poses: SQLite rewrites a whole row when one column changes. SQLite itself keeps the checksums
// right.
constexpr Words kTables[] = {
    {"meta", "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL,\n" COMAP_CHECKSUM(
                 COMAP_META_ROW) ") STRICT, WITHOUT ROWID"},
    {"robots", "CREATE TABLE robots (bit INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE,\n" COMAP_CHECKSUM(
                   COMAP_ROBOT_ROW) ") STRICT"},
    {"keyframes", R"sql(CREATE TABLE keyframes (
  arrival INTEGER PRIMARY KEY,
  robot TEXT NOT NULL REFERENCES robots (name),
  session INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  stamp_ns INTEGER NOT NULL,
  bytes INTEGER NOT NULL,
  crc32 INTEGER NOT NULL,
)sql" COMAP_CHECKSUM(COMAP_KEYFRAME_ROW) R"sql(,
  UNIQUE (robot, session, sequence)
) STRICT)sql"},
    {"keyframe_messages", R"sql(CREATE TABLE keyframe_messages (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (arrival) ON DELETE CASCADE,
  encoded BLOB NOT NULL
) STRICT)sql"},
    {"poses", R"sql(CREATE TABLE poses (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (arrival) ON DELETE CASCADE,
  map TEXT NOT NULL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
)sql" COMAP_CHECKSUM(COMAP_POSE_ROW) ") STRICT"},
    {"edges", R"sql(CREATE TABLE edges (
  number INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('odometry', 'loop', 'inter_robot', 'covisibility')),
  from_robot TEXT NOT NULL, from_session INTEGER NOT NULL, from_sequence INTEGER NOT NULL,
  to_robot TEXT NOT NULL, to_session INTEGER NOT NULL, to_sequence INTEGER NOT NULL,
  numbers BLOB NOT NULL,          -- pose and information
  merge INTEGER NOT NULL,         -- whose closure it is; 0: none
  withdrawn_by INTEGER NOT NULL,  -- the merge with whose undoing it went; 0: it holds
)sql" COMAP_CHECKSUM(COMAP_EDGE_ROW) R"sql(,
  UNIQUE (kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence)
) STRICT)sql"},
    {"verdicts", R"sql(CREATE TABLE verdicts (
  number INTEGER PRIMARY KEY,
  query_robot TEXT NOT NULL, query_session INTEGER NOT NULL, query_sequence INTEGER NOT NULL,
  candidate_robot TEXT NOT NULL, candidate_session INTEGER NOT NULL, candidate_sequence INTEGER NOT NULL,
  accepted INTEGER NOT NULL,
  reason TEXT NOT NULL,
  fern_dissimilarity REAL, inlier_ratio REAL, rms_sigma REAL, degeneracy REAL, photometric_median REAL,
  seen_through REAL, unlike REAL, features REAL, round_trip_m REAL, round_trip_rad REAL,
  numbers BLOB NOT NULL,  -- pose and information
)sql" COMAP_CHECKSUM(COMAP_VERDICT_ROW) ") STRICT"},
    {"verdicts_by_reason", "CREATE INDEX verdicts_by_reason ON verdicts (accepted, reason)"},
    {"merges", R"sql(CREATE TABLE merges (
  number INTEGER PRIMARY KEY,
  kept TEXT NOT NULL,
  absorbed TEXT NOT NULL,
  qx REAL, qy REAL, qz REAL, qw REAL, tx REAL, ty REAL, tz REAL,
  keyframes_ingested INTEGER NOT NULL,
  undone TEXT NOT NULL,        -- why; empty: it holds
  undone_by INTEGER NOT NULL,  -- the merge with whose undoing it went, itself or another; 0: it holds
)sql" COMAP_CHECKSUM(COMAP_MERGE_ROW) ") STRICT"},
    {"merge_robots", R"sql(CREATE TABLE merge_robots (
  merge INTEGER NOT NULL REFERENCES merges (number) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  robot TEXT NOT NULL,
)sql" COMAP_CHECKSUM(COMAP_MERGE_ROBOT_ROW) R"sql(,
  PRIMARY KEY (merge, position)
) STRICT, WITHOUT ROWID)sql"},
    {"merge_voters", R"sql(CREATE TABLE merge_voters (
  merge INTEGER NOT NULL REFERENCES merges (number) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  robot TEXT NOT NULL, session INTEGER NOT NULL, sequence INTEGER NOT NULL,
)sql" COMAP_CHECKSUM(COMAP_MERGE_VOTER_ROW) R"sql(,
  PRIMARY KEY (merge, position)
) STRICT, WITHOUT ROWID)sql"},
    {"tiles", R"sql(CREATE TABLE tiles (
  number INTEGER PRIMARY KEY,
  map TEXT NOT NULL,
  x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  surfels INTEGER NOT NULL,
)sql" COMAP_CHECKSUM(COMAP_TILE_ROW) R"sql(,
  zstd BLOB NOT NULL,
  UNIQUE (map, x, y, z)
) STRICT)sql"},
};

// Partial: rows that are not of these cost nothing. An index of another shape is given another name, and the old one
// goes.
constexpr const char* kIndexes[] = {
    "DROP INDEX IF EXISTS main.edges_withdrawn",
    "CREATE INDEX IF NOT EXISTS main.edges_withdrawn_by_kind ON edges (withdrawn_by, kind) WHERE withdrawn_by <> 0",
    "CREATE INDEX IF NOT EXISTS main.edges_of_merges ON edges (merge) WHERE merge <> 0",
};

constexpr const char* kIndexNames[] = {"edges_withdrawn_by_kind", "edges_of_merges"};

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
  for (const Words& table : kTables)
    if (Result<void> made = database.execute(table.sql); !made) return made;
  const std::string sql = "PRAGMA application_id = " + std::to_string(kStoreApplicationId) +
                          "; PRAGMA user_version = " + std::to_string(kStoreVersion) + ";";
  if (Result<void> made = database.execute(sql); !made) return made;
  return transaction->commit();
}

Result<void> createIndexes(Database& database) {
  for (const char* sql : kIndexes)  // of one that is there, nothing is written
    if (Result<void> made = database.execute(sql); !made) return made;
  return {};
}

std::string tableWords(const std::string& name) {
  const auto* table =
      std::find_if(std::begin(kTables), std::end(kTables), [&](const Words& one) { return one.name == name; });
  assert(table != std::end(kTables));
  return table->sql;
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

Result<bool> declaresTables(Database& database) {
  auto fresh = Database::open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!fresh) return fresh.error();
  if (auto created = createSchema(*fresh); !created) return created.error();
  const auto least = declarations(*fresh);
  if (!least) return least.error();
  const auto found = declarations(database);
  if (!found) return found.error();
  return std::includes(found->begin(), found->end(), least->begin(), least->end());
}

Result<bool> isSchema(Database& database) {
  const Result<int64_t> version = database.integer("PRAGMA user_version");
  if (!version) return version.error();
  const auto least = declaresTables(database);
  if (!least || !*least || *version != kStoreVersion) return least ? false : least;
  auto fresh = Database::open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!fresh) return fresh.error();
  if (auto created = createSchema(*fresh); !created) return created.error();
  if (auto created = createIndexes(*fresh); !created) return created.error();
  const auto most = declarations(*fresh);
  if (!most) return most.error();
  const auto found = declarations(database);
  if (!found) return found.error();
  return std::includes(most->begin(), most->end(), found->begin(), found->end());
}

Result<void> migrateSchema(Database& database, std::span<const Migration> steps, int64_t to) {
  const Result<int64_t> found = database.integer("PRAGMA user_version");
  if (!found) return found.error();
  if (*found == to) return {};
  // A table that is renamed and goes takes nothing with it that refers to it, and is followed by no reference.
  for (const char* pragma : {"PRAGMA foreign_keys = OFF", "PRAGMA legacy_alter_table = ON"})
    if (auto set = database.execute(pragma); !set) return set;
  if (auto added = addPacked(database); !added) return added;
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

std::optional<int64_t> storeVersionOf(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return std::nullopt;
  auto database = Database::open(std::filesystem::absolute(path).string(), SQLITE_OPEN_READONLY);
  if (!database) return std::nullopt;
  const auto application = database->integer("PRAGMA application_id"),
             version = database->integer("PRAGMA user_version");
  if (!application || !version || *application != kStoreApplicationId) return std::nullopt;
  return *version;
}

std::span<const Migration> storeMigrations() {
  static const Migration kSteps[] = {{3, from3To4()}};
  return kSteps;
}

}  // namespace comap
