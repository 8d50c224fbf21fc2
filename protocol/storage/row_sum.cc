#include "protocol/storage/row_sum.h"

#include <zlib.h>

namespace comap {
namespace {

void addValue(sqlite3_value* value, RowSum& sum) {
  const auto bytesOf = [&](const void* bytes) {
    return std::string_view(static_cast<const char*>(bytes), static_cast<size_t>(sqlite3_value_bytes(value)));
  };
  switch (sqlite3_value_type(value)) {
    case SQLITE_INTEGER:
      return sum.add(int64_t{sqlite3_value_int64(value)});
    case SQLITE_FLOAT:
      return sum.add(sqlite3_value_double(value));
    case SQLITE_TEXT:
      return sum.addText(bytesOf(sqlite3_value_text(value)));
    case SQLITE_BLOB:
      return sum.addBlob(bytesOf(sqlite3_value_blob(value)));
    default:
      return sum.addNull();
  }
}

void rowSum(sqlite3_context* context, int count, sqlite3_value** values) {
  RowSum sum;
  for (int i = 0; i < count; ++i) addValue(values[i], sum);
  sqlite3_result_int64(context, int64_t{sum.value()});
}

}  // namespace

void RowSum::addBytes(char letter, std::string_view bytes) {
  addWord(letter, bytes.size());
  if (bytes.size() > gathered_.size() - used_) flush();
  if (bytes.size() > gathered_.size()) {
    sum_ = static_cast<uint32_t>(crc32_z(sum_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
    return;
  }
  if (!bytes.empty()) std::memcpy(gathered_.data() + used_, bytes.data(), bytes.size());
  used_ += bytes.size();
}

uint32_t RowSum::value() {
  flush();
  return sum_;
}

void RowSum::flush() {
  sum_ = static_cast<uint32_t>(crc32_z(sum_, gathered_.data(), used_));
  used_ = 0;
}

int addRowSum(sqlite3* database) {
  // Innocuous: tables declare it, and what a file declares may use nothing else.
  return sqlite3_create_function_v2(database, "row_sum", -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS,
                                    nullptr, rowSum, nullptr, nullptr, nullptr);
}

}  // namespace comap
