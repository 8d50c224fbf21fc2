// Opening, transactions, robots, meta.
#include "mapping_core/store/map_store.h"

#include <filesystem>
#include <optional>

#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_lock.h"
#include "mapping_core/store/table_rows.h"

namespace comap {
namespace {

// In write-ahead mode SQLite keeps the file whole either way; what is committed without waiting is on the disk when
// it next waits.
constexpr const char kWaitForDisk[] = "PRAGMA synchronous = FULL";
constexpr const char kDoNotWaitForDisk[] = "PRAGMA synchronous = NORMAL";

namespace fs = std::filesystem;

Result<void> checkFile(const std::string& path, MapStore::Mode mode) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (status.type() == fs::file_type::not_found) {
    if (mode != MapStore::Mode::kCreateOrOpen) return Error{ErrorCode::kUnreachable, path + ": no such file"};
    const fs::path folder = fs::absolute(path, code).parent_path();
    if (!fs::is_directory(folder, code)) {
      return Error{ErrorCode::kUnreachable, path + ": its folder " + folder.string() + " does not exist"};
    }
    return {};
  }
  if (code) return Error{ErrorCode::kUnreachable, path + ": " + code.message()};
  if (status.type() == fs::file_type::directory) {
    return Error{ErrorCode::kUnreachable, path + ": is a folder, expected a map store"};
  }
  if (status.type() != fs::file_type::regular)
    return Error{ErrorCode::kUnreachable, path + ": is no regular file, expected a map store"};
  return {};
}

}  // namespace

MapStore::MapStore(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapStore::MapStore(MapStore&&) noexcept = default;
MapStore& MapStore::operator=(MapStore&&) noexcept = default;
MapStore::~MapStore() = default;

Result<MapStore> MapStore::open(const std::string& path, Mode mode) {
  if (Result<void> checked = checkFile(path, mode); !checked) return checked.error();
  // Absolute, so that no name has a meaning of its own to SQLite.
  const std::string absolute = fs::absolute(path).string();
  const int flags = mode == Mode::kReadOnly ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  // Before anything is read: a store that another program writes must not be brought to a newer form under it.
  std::optional<StoreLock> lock;
  if (mode != Mode::kReadOnly) {
    auto taken = StoreLock::take(absolute, mode == Mode::kCreateOrOpen);
    if (!taken) return taken.error();
    lock = std::move(*taken);
  }
  std::unique_ptr<LeavingsGuard> guard;  // before anything is read, too
  if (mode == Mode::kReadOnly) {
    (void)takeBackHalfChange(absolute);
    guard = std::make_unique<LeavingsGuard>(absolute);
  }
  Result<Database> database = Database::open(absolute, flags);
  if (!database) return database.error();

  Result<bool> ours = checkSchema(*database);
  if (!ours) return ours.error();
  if (mode != Mode::kCreateOrOpen && !*ours) return Error{ErrorCode::kBadData, absolute + ": is empty, no map store"};
  const Result<int64_t> version = database->integer("PRAGMA user_version");
  if (!version) return version.error();
  if (mode == Mode::kReadOnly && *version < kStoreVersion)
    return Error{ErrorCode::kBadData,
                 absolute + ": schema version " + std::to_string(*version) +
                     " is of an older release: mapping_core --store, or fleet finish, brings it to "
                     "this one's, " +
                     std::to_string(kStoreVersion)};
  if (mode == Mode::kReadOnly) {
    return MapStore(std::make_unique<State>(std::move(*database), std::nullopt, std::move(guard)));
  }
  for (const char* pragma : {kSetPageSize, "PRAGMA journal_mode = WAL", kWaitForDisk}) {
    if (Result<void> set = database->execute(pragma); !set) return set.error();
  }
  if (!*ours) {
    if (Result<void> created = createSchema(*database); !created) return created.error();
  } else if (Result<void> migrated = migrateSchema(*database, storeMigrations()); !migrated) {
    return migrated.error();
  }
  if (Result<void> indexed = createIndexes(*database); !indexed) return indexed.error();
  if (Result<void> set = database->execute("PRAGMA foreign_keys = ON"); !set) return set.error();
  // Who opens a store at rest changes much of it at once: every page that is touched is read and written once.
  if (mode == Mode::kOpen)
    if (Result<void> set = database->execute("PRAGMA cache_size = -262144"); !set) return set.error();
  return MapStore(std::make_unique<State>(std::move(*database), std::move(lock), nullptr));
}

const std::string& MapStore::path() const { return state_->database.path(); }

StoreTransaction::StoreTransaction(std::unique_ptr<Transaction> transaction, Database* hasty)
    : transaction_(std::move(transaction)), hasty_(hasty) {}
StoreTransaction::StoreTransaction(StoreTransaction&& other) noexcept
    : transaction_(std::move(other.transaction_)), hasty_(std::exchange(other.hasty_, nullptr)) {}
StoreTransaction::~StoreTransaction() {
  transaction_.reset();
  if (hasty_ != nullptr) (void)bool(hasty_->execute(kWaitForDisk));  // needs no disk, so nothing can go wrong
}
Result<void> StoreTransaction::commit() { return transaction_->commit(); }

Result<StoreTransaction> MapStore::begin(Durable durable) {
  Database& database = state_->database;
  const bool hasty = durable == Durable::kWithNext && !database.inTransaction();
  if (hasty)
    if (Result<void> set = database.execute(kDoNotWaitForDisk); !set) return set.error();
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) {
    if (hasty) (void)bool(database.execute(kWaitForDisk));
    return transaction.error();
  }
  return StoreTransaction(std::make_unique<Transaction>(std::move(*transaction)), hasty ? &database : nullptr);
}

Result<StoreTransaction> MapStore::beginReading() const {
  Result<Transaction> transaction = Transaction::beginReading(state_->database);
  if (!transaction) return transaction.error();
  return StoreTransaction(std::make_unique<Transaction>(std::move(*transaction)));
}

Result<std::vector<std::string>> MapStore::robots() const {
  Result<Query> query =
      state_->database.query("SELECT name, " COMAP_SOUND_OR("bit", COMAP_ROBOT_ROW) " FROM robots ORDER BY bit");
  if (!query) return query.error();
  std::vector<std::string> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    result.push_back(query->text());
    query->checked("robot");
  }
}

// What was written stays in the file, as room for what is mapped next.
Result<void> MapStore::tryWriting(size_t bytes) {
  if (auto written = setMeta("trial", std::string(bytes, '.')); !written) return written;
  return state_->database.execute("DELETE FROM meta WHERE key = 'trial'");
}

Result<uint32_t> MapStore::countStart() {
  Database& database = state_->database;
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  const Result<int64_t> before = database.integer("SELECT CAST(value AS INTEGER) FROM meta WHERE key = 'starts'");
  if (!before) return before.error();
  if (*before < 0 || *before >= INT32_MAX)
    return Error{ErrorCode::kBadData,
                 database.path() + ": meta 'starts' is " + std::to_string(*before) + ", expected a count of starts"};
  if (Result<void> set = setMeta("starts", std::to_string(*before + 1)); !set) return set.error();
  if (Result<void> committed = transaction->commit(); !committed) return committed.error();
  return static_cast<uint32_t>(*before + 1);
}

Result<bool> MapStore::votesWait() const {
  const auto value = meta("votes_wait");
  if (!value) return value.error();
  return *value == "yes";
}

Result<void> MapStore::setVotesWait(bool wait) {
  const auto waited = votesWait();
  if (!waited) return waited.error();
  return *waited == wait ? Result<void>() : setMeta("votes_wait", wait ? "yes" : "no");
}

Result<void> MapStore::setMeta(const std::string& key, const std::string& value) {
  Result<Query> query = state_->database.query(
      "INSERT INTO meta (key, value) VALUES (?, ?) ON CONFLICT (key) DO UPDATE SET value = excluded.value");
  if (!query) return query.error();
  return query->bind(key).bind(value).run();
}

Result<std::string> MapStore::meta(const std::string& key) const {
  Result<Query> query =
      state_->database.query("SELECT value, " COMAP_IS_SOUND(COMAP_META_ROW) " FROM meta WHERE key = ?");
  if (!query) return query.error();
  const Result<bool> row = query->bind(key).step();
  if (!row) return row.error();
  if (!*row) return std::string();
  const std::string value = query->text();
  if (query->integer() == 1) return value;
  return Error{ErrorCode::kBadData,
               state_->database.path() + ": meta '" + key + "' is damaged: its checksum is not that of its value"};
}

}  // namespace comap
