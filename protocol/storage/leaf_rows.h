// Rows of a database's file whose tree is damaged: read from the leaves of its tables, without the pages above them.
#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

/// A row of a table with row numbers, as it stands on its leaf.
struct LeafRow {
  struct Column {
    enum class Kind : uint8_t { kInteger, kBlob, kOther } kind = Kind::kOther;
    int64_t integer = 0;
    uint64_t offset = 0, size = 0;  ///< of a blob, within the row
  };
  int64_t number = 0;
  std::vector<Column> columns;
  uint64_t size = 0;  ///< of all columns and what tells their kinds
  // Where that is: so many bytes from this place of the file on, the others in a chain of pages.
  uint64_t local_at = 0, local_size = 0;
  uint32_t chain = 0;
};

/// Knows the form of SQLite's files (sqlite.org/fileformat2.html), and of that what a table's leaves are. Whose table a
/// leaf is of is not told on it, and leaves that were given back hold what they held: the caller has to know its rows,
/// and whether they are the last of their name. Thread rule: one thread.
class LeafRows {
 public:
  /// kUnreachable if it cannot be read, kBadData if its first page does not tell the size of pages.
  static Result<LeafRows> open(const std::string& path);

  /// Every row whose columns' kinds can be read, in the order of the file.
  void each(const std::function<void(const LeafRow&)>& visit);
  /// The bytes of a blob, if its chain leads to as many.
  std::optional<std::vector<uint8_t>> blob(const LeafRow& row, size_t column);

 private:
  LeafRows(std::ifstream file, uint32_t page_bytes, uint32_t pages)
      : file_(std::move(file)), page_bytes_(page_bytes), pages_(pages) {}
  bool read(uint64_t at, std::span<uint8_t> into);
  std::optional<LeafRow> rowAt(std::span<const uint8_t> page, uint32_t number, size_t cell) const;

  std::ifstream file_;
  uint32_t page_bytes_, pages_;
};

}  // namespace comap
