// The tables of a map store, and whether a file is one.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "protocol/storage/database.h"

namespace comap {

inline constexpr int64_t kStoreApplicationId = 0x436f4d61;  ///< "CoMa" in the file's header
inline constexpr int64_t kStoreVersion = 4;                 ///< user_version in the file's header
inline constexpr int64_t kFirstStoreVersion = 3;            ///< older ones are not read

/// Of a file that is made; one that is there keeps its own. Four times SQLite's: much of a large store that is changed
/// at once is then a quarter as many reads and writes, for a third more bytes written while it grows.
inline constexpr const char kSetPageSize[] = "PRAGMA page_size = 16384";

/// Makes the tables in an empty database, all or none.
Result<void> createSchema(Database& database);

/// Makes those indexes that are missing: for speed alone, no part of the version. Stores of earlier releases have none
/// until a program opens them to write.
Result<void> createIndexes(Database& database);
/// The words that declare a table, or an index that is part of the version.
std::string tableWords(const std::string& name);
/// Names of those for speed.
std::span<const char* const> indexNames();

/// kBadData, with what was found and expected, if it is another application's database or of a version that this
/// program cannot read. Returns false if the database is empty.
Result<bool> checkSchema(Database& database);

/// Whether each table is there, and declared word by word as this program does it; there may be more.
Result<bool> declaresTables(Database& database);

/// Whether tables and indexes are this program's, word by word, and nothing else is there; indexes for speed may be
/// missing.
Result<bool> isSchema(Database& database);

/// That of the file at `path`; nothing if it cannot be read, or is no store.
std::optional<int64_t> storeVersionOf(const std::string& path);

/// What brings a store of version `from` to the next one.
struct Migration {
  int64_t from;
  const char* sql;
};

/// Brings a store of an older release to version `to`, all steps or none; one that is there already is left alone.
/// kBadData if a step is missing. Only for databases that checkSchema knows, opened to be written. Foreign keys
/// are not looked at afterwards, unless that is switched on again.
Result<void> migrateSchema(Database& database, std::span<const Migration> steps, int64_t to = kStoreVersion);

/// Those of this program: a line for each version after the first one.
std::span<const Migration> storeMigrations();

}  // namespace comap
