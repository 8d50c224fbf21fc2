#include "protocol/storage/leaf_rows.h"

#include <algorithm>

namespace comap {
namespace {

constexpr uint8_t kTableLeaf = 13;
constexpr size_t kLeafHeader = 8;
constexpr uint64_t kMostColumns = 100;

using Bytes = std::span<const uint8_t>;

uint32_t bigEndian(Bytes bytes) {
  uint32_t value = 0;
  for (const uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

// Takes SQLite's number of 1 to 9 bytes from the front.
std::optional<uint64_t> takeNumber(Bytes& bytes) {
  uint64_t value = 0;
  for (size_t i = 0; i < 9 && i < bytes.size(); ++i) {
    const bool last = i == 8;
    value = last ? value << 8 | bytes[i] : value << 7 | (bytes[i] & 0x7f);
    if (!last && (bytes[i] & 0x80) != 0) continue;
    bytes = bytes.subspan(i + 1);
    return value;
  }
  return std::nullopt;
}

// Of an integer column by its kind; nothing if the kind is another.
std::optional<size_t> integerBytes(uint64_t kind) {
  constexpr size_t kBytes[] = {0, 1, 2, 3, 4, 6, 8};
  if (kind == 8 || kind == 9) return 0;
  return kind >= 1 && kind <= 6 ? std::optional(kBytes[kind]) : std::nullopt;
}

int64_t signedNumber(Bytes bytes) {
  uint64_t value = bytes.empty() || bytes[0] < 0x80 ? 0 : ~uint64_t{0};
  for (const uint8_t byte : bytes) value = value << 8 | byte;
  return static_cast<int64_t>(value);
}

// The columns of a row, of which `local` is the beginning.
std::optional<std::vector<LeafRow::Column>> columnsOf(Bytes local, uint64_t size) {
  Bytes kinds = local;
  const auto header = takeNumber(kinds);
  if (!header || *header > local.size() || *header < local.size() - kinds.size()) return std::nullopt;
  kinds = local.first(*header).subspan(local.size() - kinds.size());
  std::vector<LeafRow::Column> columns;
  uint64_t offset = *header;
  while (!kinds.empty()) {
    const auto kind = takeNumber(kinds);
    if (!kind || columns.size() == kMostColumns) return std::nullopt;
    LeafRow::Column column;
    column.offset = offset;
    if (const auto bytes = integerBytes(*kind)) {
      if (offset + *bytes > local.size()) return std::nullopt;
      column.kind = LeafRow::Column::Kind::kInteger;
      column.size = *bytes;
      column.integer = *kind == 9 ? 1 : signedNumber(local.subspan(offset, *bytes));
    } else {
      column.size = *kind == 7 ? 8 : *kind >= 12 ? (*kind - 12) / 2 : 0;
      if (*kind >= 12 && *kind % 2 == 0) column.kind = LeafRow::Column::Kind::kBlob;
    }
    if (column.size > size || offset + column.size > size) return std::nullopt;
    offset += column.size;
    columns.push_back(column);
  }
  if (offset != size) return std::nullopt;
  return columns;
}

// How much of a row of `size` bytes stands on its leaf.
uint64_t localBytes(uint64_t size, uint64_t page_bytes) {
  const uint64_t most = page_bytes - 35, least = (page_bytes - 12) * 32 / 255 - 23;
  if (size <= most) return size;
  const uint64_t fitting = least + (size - least) % (page_bytes - 4);
  return fitting <= most ? fitting : least;
}

}  // namespace

Result<LeafRows> LeafRows::open(const std::string& path) {
  constexpr size_t kSizeAt = 16;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto bytes = static_cast<int64_t>(file.tellg());
  if (!file || bytes < 0) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  uint8_t told[2] = {};
  file.seekg(kSizeAt);
  file.read(reinterpret_cast<char*>(told), sizeof told);
  const uint32_t size = bigEndian(told) == 1 ? 65536 : bigEndian(told);
  if (!file || size < 512 || (size & (size - 1)) != 0)
    return Error{ErrorCode::kBadData, path + ": the size of its pages cannot be read"};
  const auto pages = std::min<int64_t>(bytes / size, 0xfffffffe);
  return LeafRows(std::move(file), size, static_cast<uint32_t>(pages));
}

bool LeafRows::read(uint64_t at, std::span<uint8_t> into) {
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(reinterpret_cast<char*>(into.data()), static_cast<std::streamsize>(into.size()));
  return static_cast<bool>(file_);
}

std::optional<LeafRow> LeafRows::rowAt(std::span<const uint8_t> page, uint32_t number, size_t cell) const {
  if (cell < kLeafHeader || cell >= page.size()) return std::nullopt;
  Bytes rest = page.subspan(cell);
  const auto size = takeNumber(rest);
  const auto row_number = size ? takeNumber(rest) : std::nullopt;
  if (!row_number || *size > uint64_t{pages_} * page_bytes_) return std::nullopt;
  LeafRow row;
  row.number = static_cast<int64_t>(*row_number);
  row.size = *size;
  row.local_size = localBytes(*size, page_bytes_);
  const bool goes_on = row.local_size < row.size;
  if (rest.size() < row.local_size + (goes_on ? 4 : 0)) return std::nullopt;
  row.local_at = uint64_t{number - 1} * page_bytes_ + (page.size() - rest.size());
  if (goes_on) row.chain = bigEndian(rest.subspan(row.local_size, 4));
  auto columns = columnsOf(rest.first(row.local_size), row.size);
  if (!columns) return std::nullopt;
  row.columns = std::move(*columns);
  return row;
}

// The first page, which begins with other things, holds the list of tables.
void LeafRows::each(const std::function<void(const LeafRow&)>& visit) {
  std::vector<uint8_t> page(page_bytes_);
  for (uint32_t number = 2; number <= pages_; ++number) {
    if (!read(uint64_t{number - 1} * page_bytes_, page) || page[0] != kTableLeaf) continue;
    const Bytes bytes(page);
    const size_t rows = std::min<size_t>(bigEndian(bytes.subspan(3, 2)), (page.size() - kLeafHeader) / 2);
    for (size_t i = 0; i < rows; ++i)
      if (const auto row = rowAt(bytes, number, bigEndian(bytes.subspan(kLeafHeader + 2 * i, 2)))) visit(*row);
  }
}

std::optional<std::vector<uint8_t>> LeafRows::blob(const LeafRow& row, size_t column) {
  if (column >= row.columns.size() || row.columns[column].kind != LeafRow::Column::Kind::kBlob) return std::nullopt;
  std::vector<uint8_t> bytes(row.size);
  if (!read(row.local_at, std::span(bytes).first(row.local_size))) return std::nullopt;
  uint32_t next = row.chain;
  for (uint64_t at = row.local_size; at < row.size;) {
    uint8_t link[4] = {};
    const uint64_t count = std::min<uint64_t>(row.size - at, page_bytes_ - sizeof link);
    const uint64_t place = uint64_t{next - 1} * page_bytes_;
    if (next < 2 || next > pages_ || !read(place, link) ||
        !read(place + sizeof link, std::span(bytes).subspan(at, count)))
      return std::nullopt;
    next = bigEndian(link);
    at += count;
  }
  const LeafRow::Column& told = row.columns[column];
  return std::vector<uint8_t>(bytes.begin() + static_cast<std::ptrdiff_t>(told.offset),
                              bytes.begin() + static_cast<std::ptrdiff_t>(told.offset + told.size));
}

}  // namespace comap
