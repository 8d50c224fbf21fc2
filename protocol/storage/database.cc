#include "protocol/storage/database.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <utility>

#include "protocol/storage/row_sum.h"

namespace comap {
namespace {

constexpr int kBusyTimeout_ms = 10000;
constexpr int kMaxValueBytes = 256 << 20;  // what a damaged file can make us allocate at once

ErrorCode codeOf(int code) {
  if (code == SQLITE_IOERR_SHORT_READ) return ErrorCode::kBadData;
  switch (code & 0xff) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_FORMAT:
    case SQLITE_ERROR:  // a table or column is missing: the file is not what its version says
      return ErrorCode::kBadData;
    case SQLITE_CONSTRAINT:
    case SQLITE_TOOBIG:
    case SQLITE_MISUSE:
      return ErrorCode::kWrongUse;
    case SQLITE_NOMEM:
      return ErrorCode::kOutOfMemory;
    default:
      return ErrorCode::kUnreachable;
  }
}

const char* adviceFor(int code) {
  if (code == SQLITE_READONLY_ROLLBACK)
    return " (its writer was killed within a change, which is taken back where it can be written: copy it there, with "
           "its -journal)";
  switch (code & 0xff) {
    case SQLITE_FULL:
      return " (no space left; nothing was written)";
    case SQLITE_READONLY:
      return " (the store is open for reading only, or write protected)";
    case SQLITE_BUSY:
      return " (another process is writing to it)";
    case SQLITE_NOTADB:
      return " (not SQLite's)";
    case SQLITE_CORRUPT:
      return " (the file is damaged)";
    case SQLITE_CANTOPEN:
      return " (no access; a store that was not closed can only be read in a folder that can be written)";
    default:
      return "";
  }
}

}  // namespace

Result<Database> Database::open(const std::string& path, int flags) {
  Database database(path);
  const int code =
      sqlite3_open_v2(path.c_str(), &database.handle_, flags | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_NOMUTEX, nullptr);
  if (code != SQLITE_OK) return database.error(code);
  if (const int added = addRowSum(database.handle_); added != SQLITE_OK) return database.error(added);
  database.waitForOthers();
  sqlite3_limit(database.handle_, SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  // The file may come from anywhere: its schema must not be able to do more than hold data.
  sqlite3_db_config(database.handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(database.handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(database.handle_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  return database;
}

Database::Database(Database&& other) noexcept
    : path_(std::move(other.path_)),
      handle_(std::exchange(other.handle_, nullptr)),
      statements_(std::exchange(other.statements_, {})),
      made_statements_(std::exchange(other.made_statements_, {})) {}

Database& Database::operator=(Database&& other) noexcept {
  if (this == &other) return *this;
  const Database closed(std::move(*this));  // now, and not when `other` ends: its file may be opened by the next line
  std::swap(path_, other.path_);
  std::swap(handle_, other.handle_);
  std::swap(statements_, other.statements_);
  std::swap(made_statements_, other.made_statements_);
  return *this;
}

Database::~Database() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  for (const auto& [sql, statement] : made_statements_) sqlite3_finalize(statement);
  sqlite3_close(handle_);
}

Result<Query> Database::query(const char* literal) { return prepared(statements_[literal], literal); }

Result<Query> Database::query(const std::string& sql) { return prepared(made_statements_[sql], sql.c_str()); }

Result<Query> Database::prepared(sqlite3_stmt*& statement, const char* sql) {
  if (statement == nullptr) {
    const int code = sqlite3_prepare_v3(handle_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
    if (code != SQLITE_OK) return error(code);
  }
  return Query(*this, statement);
}

Result<void> Database::execute(const char* sql) {
  const int code = sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return error(code);
  return {};
}

Result<int64_t> Database::integer(const char* literal) {
  Result<Query> asked = query(literal);
  if (!asked) return asked.error();
  const Result<bool> row = asked->step();
  if (!row) return row.error();
  return *row ? asked->integer() : 0;
}

Result<void> Database::attachReading(const std::string& path, const std::string& name) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '.' || c == '-' || c == '_';
    char hex[4];
    std::snprintf(hex, sizeof hex, "%%%02X", static_cast<unsigned char>(c));
    uri += plain ? std::string(1, c) : std::string(hex);
  }
  const auto attach = [&](const char* mode) -> Result<void> {
    Result<Query> attached = query("ATTACH ? AS ?");
    if (!attached) return attached.error();
    return attached->bind(uri + mode).bind(name).run();
  };
  // From a database that it may only read, SQLite copies a table with unique indexes row by row, in four times the
  // time. Nothing is written to this one either way, unless there is a log, which would be played back into it.
  std::error_code code;
  const bool logged = std::filesystem::exists(path + "-wal", code) || std::filesystem::exists(path + "-journal", code);
  if (!logged && attach("?mode=rw")) return {};
  return attach("?mode=ro");
}

Result<void> Database::addFunction(const char* name, void (*function)(sqlite3_context*, int, sqlite3_value**)) {
  const int code = sqlite3_create_function_v2(handle_, name, -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr, function,
                                              nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? Result<void>() : error(code);
}

void Database::bearDamage() {
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);  // it forbids the next
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
}

void Database::leaveWal() {
  sqlite3_busy_timeout(handle_, 0);
  sqlite3_exec(handle_, "PRAGMA journal_mode = DELETE", nullptr, nullptr, nullptr);  // busy: stays in its log, as well
}

void Database::waitForOthers() { sqlite3_busy_timeout(handle_, kBusyTimeout_ms); }

bool Database::inTransaction() const { return sqlite3_get_autocommit(handle_) == 0; }

int Database::changes() const { return sqlite3_changes(handle_); }

Error Database::error(int code) const {
  const char* message = handle_ != nullptr ? sqlite3_errmsg(handle_) : sqlite3_errstr(code);
  return {codeOf(code), path_ + ": " + message + adviceFor(code)};
}

Result<Transaction> Transaction::begin(Database& database) {
  const bool nested = database.inTransaction();
  if (Result<void> begun = database.execute(nested ? "SAVEPOINT inner" : "BEGIN IMMEDIATE"); !begun)
    return begun.error();
  return Transaction(database, nested);
}

Result<Transaction> Transaction::beginReading(Database& database) {
  const bool nested = database.inTransaction();
  if (Result<void> begun = database.execute(nested ? "SAVEPOINT inner" : "BEGIN"); !begun) return begun.error();
  return Transaction(database, nested);
}

Transaction::~Transaction() {
  // Fails only where SQLite has rolled back already.
  if (database_ != nullptr) (void)bool(database_->execute(nested_ ? "ROLLBACK TO inner; RELEASE inner" : "ROLLBACK"));
}

Result<void> Transaction::commit() {
  Result<void> committed = database_->execute(nested_ ? "RELEASE inner" : "COMMIT");
  if (committed) database_ = nullptr;
  return committed;
}

}  // namespace comap
