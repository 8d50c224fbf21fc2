// The checksum of a row: what SQL calls row_sum(...).
#pragma once

#include <sqlite3.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace comap {

/// The CRC-32 (zlib's) of values, one behind the other, each as a letter and what follows: "n" NULL; "i" INTEGER and
/// "r" REAL, 8 bytes; "t" TEXT and "b" BLOB, their length in 8 bytes and themselves. Numbers little endian; a REAL that
/// is 0 without its sign, as SQLite keeps it.
class RowSum {
 public:
  void addNull() {
    if (used_ == gathered_.size()) flush();
    gathered_[used_++] = 'n';
  }
  void add(int64_t number) { addWord('i', static_cast<uint64_t>(number)); }
  void add(double number) { addWord('r', std::bit_cast<uint64_t>(number == 0 ? 0.0 : number)); }
  void addText(std::string_view text) { addBytes('t', text); }
  void addBlob(std::string_view bytes) { addBytes('b', bytes); }
  uint32_t value();

 private:
  void addWord(char letter, uint64_t word) {
    if (gathered_.size() - used_ < 1 + sizeof word) flush();
    gathered_[used_] = static_cast<uint8_t>(letter);
    std::memcpy(gathered_.data() + used_ + 1, &word, sizeof word);
    used_ += 1 + sizeof word;
  }
  void addBytes(char letter, std::string_view bytes);
  void flush();
  static_assert(std::endian::native == std::endian::little, "words are summed as they lie in memory");
  std::array<uint8_t, 1024> gathered_;  // not each value by itself: long runs are quicker
  size_t used_ = 0;
  uint32_t sum_ = 0;
};

/// From now on statements know row_sum(...), of any number of values: their RowSum. Returns SQLite's code.
int addRowSum(sqlite3* database);

}  // namespace comap
