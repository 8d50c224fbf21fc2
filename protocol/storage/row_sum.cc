#include "protocol/storage/row_sum.h"

#include <zlib.h>

#include <utility>

namespace comap {
namespace {

// What a byte does to a CRC-32 that is followed by so many others.
struct CrcTables {
  std::array<std::array<uint32_t, 256>, 16> after{};
  constexpr CrcTables() {
    for (uint32_t byte = 0; byte < 256; ++byte) {
      uint32_t sum = byte;
      for (int bit = 0; bit < 8; ++bit) sum = (sum & 1) != 0 ? 0xedb88320u ^ sum >> 1 : sum >> 1;
      after[0][byte] = sum;
    }
    for (size_t others = 1; others < after.size(); ++others)
      for (size_t byte = 0; byte < 256; ++byte) {
        const uint32_t before = after[others - 1][byte];
        after[others][byte] = after[0][before & 255] ^ before >> 8;
      }
  }
};
constexpr CrcTables kCrc;

uint64_t wordAt(const uint8_t* bytes) {
  uint64_t word = 0;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

// Of eight bytes with `kOthers` behind them.
template <size_t kOthers, size_t... kByte>
uint32_t crcOfWord(uint64_t word, std::index_sequence<kByte...>) {
  return (kCrc.after[kOthers + 7 - kByte][word >> 8 * kByte & 255] ^ ...);
}
template <size_t kOthers>
uint32_t crcOfWord(uint64_t word) {
  return crcOfWord<kOthers>(word, std::make_index_sequence<8>());
}

// zlib's takes twice as long for rows as short as ours.
uint32_t crcOfShort(uint32_t before, const uint8_t* bytes, size_t count) {
  uint32_t sum = ~before;
  for (; count >= 16; bytes += 16, count -= 16)
    sum = crcOfWord<8>(wordAt(bytes) ^ sum) ^ crcOfWord<0>(wordAt(bytes + 8));
  for (; count > 0; ++bytes, --count) sum = kCrc.after[0][(sum ^ *bytes) & 255] ^ sum >> 8;
  return ~sum;
}

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
  sum_ = crcOfShort(sum_, gathered_.data(), used_);
  used_ = 0;
}

int addRowSum(sqlite3* database) {
  // Innocuous: tables declare it, and what a file declares may use nothing else.
  return sqlite3_create_function_v2(database, "row_sum", -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS,
                                    nullptr, rowSum, nullptr, nullptr, nullptr);
}

}  // namespace comap
