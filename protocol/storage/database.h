// A thin hold on SQLite: one connection, statements prepared once, errors as Result with the file's name in them.
#pragma once

#include <sqlite3.h>

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/types/ids.h"
#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap {

class Database;

/// Whether a row is as it was written.
enum class RowState : uint8_t { kSound, kMistyped, kUnsound };

/// One run of a prepared statement: bind from left to right, step, read columns from left to right. Resets itself.
/// What is wrong with a bound value or a read column is kept and comes out of the next step().
class Query {
 public:
  Query(Database& database, sqlite3_stmt* statement) : database_(&database), statement_(statement) {}
  Query(Query&& other) noexcept;
  Query& operator=(Query&&) = delete;
  ~Query();

  Query& bind(int64_t value);
  Query& bind(double value);  ///< NaN becomes NULL
  Query& bind(const std::string& value);
  Query& bind(std::span<const uint8_t> bytes);  ///< must outlive the run
  Query& bind(const KeyframeId& id);            ///< 3 columns
  Query& bind(const Pose& pose);                ///< 7 columns

  /// True: a row is there; false: done.
  Result<bool> step();
  /// What was wrong with the columns read so far, if anything: what the next step() would tell.
  Result<void> values() const;
  /// Forgets that.
  void forgive() { damage_.clear(); }
  /// For statements without rows.
  Result<void> run();

  /// Whether the columns from the next one on are of these types, a letter each: i INTEGER, t TEXT, b BLOB, r REAL or
  /// NULL. Reads none of them. Else a column would be read as what it is expected to be: a damaged row can hold any.
  bool areOf(std::string_view types) const;
  /// Of all columns of a table, in the order of its checksum, which follows them, from the next one on: whether they
  /// are of these types, and fit the checksum. Reads none of them.
  RowState rowState(std::string_view types) const;

  void skip(int columns) { column_ += columns; }
  int64_t integer();
  uint32_t unsigned32();  ///< out of range: kBadData at the next step
  double real();          ///< NULL is NaN
  std::string text() { return std::string(textView()); }
  std::string_view textView();       ///< valid until the next step
  std::span<const uint8_t> bytes();  ///< valid until the next step
  KeyframeId keyframeId();
  Pose pose();
  /// Of a column that is -1, or else the row's number because its checksum is not that of its values. `what`: a row's
  /// name.
  void checked(const char* what);
  /// The same of a row whose rowState() was asked for.
  void judged(RowState state, const char* what, int64_t number);
  /// What else is wrong with the row.
  void damaged(const std::string& text) { damage_ = text; }

 private:
  void note(int code);
  sqlite3_value* at(int column) const;
  Database* database_;
  sqlite3_stmt* statement_;
  mutable std::array<sqlite3_value*, 32> kept_;  // of this row, those that are `known_`, a bit each
  mutable uint32_t known_ = 0;
  int parameter_ = 0, column_ = 0;
  int bind_code_ = SQLITE_OK;
  std::string damage_;
};

/// What seven numbers (qx, qy, qz, qw, tx, ty, tz) are as a pose. All NaN: none. `wrong`: why they are none, else
/// untouched.
Pose poseOf(std::span<const double, 7> numbers, std::string& wrong);

/// Thread rule: one thread at a time; SQLite's own locks, one for each value that is read, are left out.
class Database {
 public:
  /// `flags` as sqlite3_open_v2. kUnreachable if it cannot be opened.
  static Result<Database> open(const std::string& path, int flags);
  Database(Database&& other) noexcept;
  Database& operator=(Database&& other) noexcept;
  ~Database();

  /// Reads what is there of a file whose end is missing, and deletes rows that an index does not know; SQLite refuses
  /// both else. Only for a damaged file opened for reading, or for a copy.
  void bearDamage();

  /// `name` stands for the database at `path`, which is only read. Only if this one was opened with SQLITE_OPEN_URI.
  Result<void> attachReading(const std::string& path, const std::string& name);

  /// From now on statements know the function `name`, of any number of values. All know row_sum (row_sum.h).
  Result<void> addFunction(const char* name, void (*function)(sqlite3_context*, int, sqlite3_value**));

  /// Statements are kept: a literal by its address, which is quick, others by their words.
  Result<Query> query(const char* literal);
  Result<Query> query(const std::string& sql);
  /// Statements without parameters or rows.
  Result<void> execute(const char* sql);
  Result<void> execute(const std::string& sql) { return execute(sql.c_str()); }
  /// The single integer that a statement yields; 0 if it has no row.
  Result<int64_t> integer(const char* literal);
  int changes() const;
  bool inTransaction() const;
  /// From now on waits as long for others as it did when it was opened.
  void waitForOthers();
  /// Puts everything into the one file, if no other connection is open: a finished store can then be read from a
  /// folder that cannot be written, and reading it leaves nothing behind.
  void leaveWal();
  /// The error of the last call, in terms of `code`.
  Error error(int code) const;
  const std::string& path() const { return path_; }

 private:
  explicit Database(std::string path) : path_(std::move(path)) {}
  Result<Query> prepared(sqlite3_stmt*& statement, const char* sql);
  std::string path_;
  sqlite3* handle_ = nullptr;
  std::map<const char*, sqlite3_stmt*> statements_;
  std::map<std::string, sqlite3_stmt*> made_statements_;
};

/// Rolled back unless committed. One begun within another is part of it: durable when the outer one is committed.
class Transaction {
 public:
  static Result<Transaction> begin(Database& database);
  /// All that is read until its end is of one moment, whatever others write; it locks nobody out.
  static Result<Transaction> beginReading(Database& database);
  Transaction(Transaction&& other) noexcept : database_(other.database_), nested_(other.nested_) {
    other.database_ = nullptr;
  }
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();
  Result<void> commit();

 private:
  Transaction(Database& database, bool nested) : database_(&database), nested_(nested) {}
  Database* database_;
  bool nested_;
};

}  // namespace comap
