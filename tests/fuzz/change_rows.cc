#include "tests/fuzz/change_rows.h"

#include <sqlite3.h>
#include <zlib.h>

#include <limits>
#include <span>
#include <vector>

#include "protocol/storage/row_sum.h"
#include "protocol/types/fnv1a.h"
#include "tests/fuzz/fuzz.h"

namespace comap::fuzz {
namespace {

struct Column {
  std::string table, name, type;
};

void checksum(sqlite3_context* context, int, sqlite3_value** values) {
  const auto* bytes = static_cast<const Bytef*>(sqlite3_value_blob(values[0]));
  sqlite3_result_int64(context, static_cast<int64_t>(crc32_z(0, bytes, size_t(sqlite3_value_bytes(values[0])))));
}

// As a robot's tile store forms it, of x, y, z, revision and content.
void tileChecksum(sqlite3_context* context, int, sqlite3_value** values) {
  Fnv1a hash;
  for (int i = 0; i < 3; ++i) hash.add(static_cast<uint32_t>(sqlite3_value_int64(values[i])));
  hash.add(static_cast<uint64_t>(sqlite3_value_int64(values[3])));
  const auto* bytes = static_cast<const uint8_t*>(sqlite3_value_blob(values[4]));
  hash.addAll(std::span(bytes, static_cast<size_t>(sqlite3_value_bytes(values[4]))));
  sqlite3_result_int64(context, static_cast<int64_t>(hash.value()));
}

std::vector<Column> columnsOf(sqlite3* database) {
  std::vector<Column> columns;
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database,
                     "SELECT t.name, c.name, c.type FROM pragma_table_list t, pragma_table_info(t.name) c "
                     "WHERE t.schema = 'main' AND t.name NOT LIKE 'sqlite%' ORDER BY 1, c.cid",
                     -1, &statement, nullptr);
  const auto text = [&](int i) {
    return std::string(reinterpret_cast<const char*>(sqlite3_column_text(statement, i)));
  };
  while (sqlite3_step(statement) == SQLITE_ROW) columns.push_back({text(0), text(1), text(2)});
  sqlite3_finalize(statement);
  return columns;
}

void bindValue(sqlite3_stmt* statement, const std::string& type, FuzzedDataProvider& bytes) {
  constexpr int64_t kIntegers[] = {-1,
                                   0,
                                   1,
                                   2,
                                   65535,
                                   4294967295,
                                   4294967296,
                                   std::numeric_limits<int64_t>::max(),
                                   std::numeric_limits<int64_t>::min()};
  constexpr double kReals[] = {0, 1, -1, 1e-300, 1e300, std::numeric_limits<double>::infinity()};
  if (type == "INTEGER") {
    const bool known = bytes.ConsumeBool();
    sqlite3_bind_int64(statement, 1, known ? bytes.PickValueInArray(kIntegers) : bytes.ConsumeIntegral<int64_t>());
  } else if (type == "REAL") {
    if (bytes.ConsumeBool())
      sqlite3_bind_double(statement, 1, bytes.PickValueInArray(kReals));
    else if (bytes.ConsumeBool())
      sqlite3_bind_null(statement, 1);
    else
      sqlite3_bind_double(statement, 1, bytes.ConsumeFloatingPoint<double>());
  } else if (type == "TEXT") {
    const std::string text = bytes.ConsumeRandomLengthString(80);
    sqlite3_bind_text(statement, 1, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  } else {
    const auto blob = bytes.ConsumeBytes<uint8_t>(bytes.ConsumeIntegralInRange<size_t>(0, 4096));
    sqlite3_bind_blob(statement, 1, blob.empty() ? "" : reinterpret_cast<const char*>(blob.data()),
                      static_cast<int>(blob.size()), SQLITE_TRANSIENT);
  }
}

}  // namespace

void changeRows(const std::string& path, FuzzedDataProvider& bytes) {
  sqlite3* database = nullptr;
  require(sqlite3_open(path.c_str(), &database) == SQLITE_OK, "a database that was just made can be opened");
  sqlite3_exec(database, "PRAGMA synchronous = OFF; PRAGMA ignore_check_constraints = ON", nullptr, nullptr, nullptr);
  require(addRowSum(database) == SQLITE_OK, "a store's tables can be written");
  sqlite3_create_function(database, "checksum", 1, SQLITE_UTF8, nullptr, checksum, nullptr, nullptr);
  sqlite3_create_function(database, "tile_checksum", 5, SQLITE_UTF8, nullptr, tileChecksum, nullptr, nullptr);
  const std::vector<Column> columns = columnsOf(database);
  require(!columns.empty(), "a database has columns");
  sqlite3_exec(database, "BEGIN", nullptr, nullptr, nullptr);
  for (int edits = bytes.ConsumeIntegralInRange(1, 6); edits > 0; --edits) {
    const Column& column = columns[bytes.ConsumeIntegralInRange<size_t>(0, columns.size() - 1)];
    const std::string which = " WHERE rowid % 7 = " + std::to_string(bytes.ConsumeIntegralInRange(0, 6));
    const bool take_out = bytes.ConsumeIntegralInRange(0, 9) == 0;
    const std::string sql =
        take_out ? "DELETE FROM " + column.table : "UPDATE " + column.table + " SET " + column.name + " = ?1";
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database, (sql + which).c_str(), -1, &statement, nullptr) != SQLITE_OK)
      sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);  // a table without rowid
    if (!take_out) bindValue(statement, column.type, bytes);
    sqlite3_step(statement);
    sqlite3_finalize(statement);
  }
  if (bytes.ConsumeBool()) {
    for (const char* sql :
         {"UPDATE keyframes SET (bytes, crc32) = (SELECT length(encoded), checksum(encoded) FROM keyframe_messages "
          "WHERE keyframe = arrival)",
          "UPDATE keyframes SET (bytes, crc32) = (SELECT length(encoded), checksum(encoded) FROM messages m "
          "WHERE m.session = keyframes.session AND m.sequence = keyframes.sequence)",
          "UPDATE tile SET checksum = tile_checksum(x, y, z, revision, content)"})
      sqlite3_exec(database, sql, nullptr, nullptr, nullptr);  // one of them, of this kind of file
  }
  sqlite3_exec(database, "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_close(database);
}

}  // namespace comap::fuzz
