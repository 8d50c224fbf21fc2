#include "protocol/storage/row_sum.h"

#include <zlib.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace comap {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are summed as they lie in memory");

// Gathers small pieces: zlib takes its time for each call.
class Sum {
 public:
  void add(char letter) { add(&letter, 1); }
  template <class Number>
  void addNumber(Number number) {
    static_assert(sizeof number == 8);
    add(&number, sizeof number);
  }
  void add(const void* bytes, size_t count) {
    if (count > gathered_.size() - used_) flush();
    if (count > gathered_.size()) {
      state_ = crc32_z(state_, static_cast<const Bytef*>(bytes), count);
      return;
    }
    if (count > 0) std::memcpy(gathered_.data() + used_, bytes, count);
    used_ += count;
  }
  uint32_t value() {
    flush();
    return static_cast<uint32_t>(state_);
  }

 private:
  void flush() {
    state_ = crc32_z(state_, gathered_.data(), used_);
    used_ = 0;
  }
  std::array<Bytef, 1024> gathered_;
  size_t used_ = 0;
  uLong state_ = 0;
};

void addValue(sqlite3_value* value, Sum& sum) {
  switch (sqlite3_value_type(value)) {
    case SQLITE_INTEGER:
      sum.add('i');
      return sum.addNumber(int64_t{sqlite3_value_int64(value)});
    case SQLITE_FLOAT: {
      const double real = sqlite3_value_double(value);
      sum.add('r');
      return sum.addNumber(real == 0 ? 0.0 : real);
    }
    case SQLITE_TEXT:
    case SQLITE_BLOB: {
      const bool text = sqlite3_value_type(value) == SQLITE_TEXT;
      const void* bytes = text ? static_cast<const void*>(sqlite3_value_text(value)) : sqlite3_value_blob(value);
      const auto count = static_cast<size_t>(sqlite3_value_bytes(value));
      sum.add(text ? 't' : 'b');
      sum.addNumber(uint64_t{count});
      return sum.add(bytes, count);
    }
    default:
      return sum.add('n');
  }
}

void rowSum(sqlite3_context* context, int count, sqlite3_value** values) {
  Sum sum;
  for (int i = 0; i < count; ++i) addValue(values[i], sum);
  sqlite3_result_int64(context, int64_t{sum.value()});
}

}  // namespace

int addRowSum(sqlite3* database) {
  // Innocuous: tables declare it, and what a file declares may use nothing else.
  return sqlite3_create_function_v2(database, "row_sum", -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS,
                                    nullptr, rowSum, nullptr, nullptr, nullptr);
}

}  // namespace comap
