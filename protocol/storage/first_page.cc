#include "protocol/storage/first_page.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

namespace comap {
namespace {

// sqlite.org/fileformat2.html, 1.3
constexpr size_t kPageSizeAt = 16, kPagesAt = 28, kFreeAt = 32, kFreeEnd = 40, kHead = 100;
constexpr std::string_view kMagic("SQLite format 3\0", 16);

// A number that has to be within bounds, and what it becomes if it is not.
struct Field {
  const char* name;
  size_t at, bytes;
  uint32_t least, most, mended;
  bool told_with_tables = false;  // 0 in a file that has none
};
constexpr Field kFields[] = {
    {"version to write it", 18, 1, 1, 2, 1},
    {"version to read it", 19, 1, 1, 2, 1},
    {"bytes left free on each page", 20, 1, 0, 0, 0},
    {"format of the schema", 44, 4, 1, 4, 4, true},
    {"largest root page, of a file that shrinks by itself", 52, 4, 0, 0, 0},
    {"encoding of texts", 56, 4, 1, 1, 1, true},
    {"shrinking in steps", 64, 4, 0, 0, 0},
    {"reserved", 72, 4, 0, 0, 0},
    {"reserved", 76, 4, 0, 0, 0},
    {"reserved", 80, 4, 0, 0, 0},
    {"reserved", 84, 4, 0, 0, 0},
    {"reserved", 88, 4, 0, 0, 0},
};

uint32_t numberAt(const std::vector<char>& head, size_t at, size_t bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<uint8_t>(head[at + i]);
  return value;
}

uint32_t valueOf(const Field& field, const std::vector<char>& head) { return numberAt(head, field.at, field.bytes); }

// A file whose writer was killed before it first wrote its log into it: all tables, each with a page of its own, are in
// the log.
bool hasNoTables(const std::vector<char>& head) { return numberAt(head, kPagesAt, 4) == 1; }

std::vector<Field> wrongFields(const std::vector<char>& head) {
  std::vector<Field> wrong;
  if (head.size() < kHead || !std::equal(kMagic.begin(), kMagic.end(), head.begin())) return wrong;
  for (const Field& field : kFields) {
    const uint32_t value = valueOf(field, head);
    if (field.told_with_tables && value == 0 && hasNoTables(head)) continue;
    if (value < field.least || value > field.most) wrong.push_back(field);
  }
  return wrong;
}

}  // namespace

std::vector<std::string> headDamage(const std::string& path) {
  const std::vector<char> head = firstBytesOf(path, kHead);
  std::vector<std::string> damage;
  for (const Field& field : wrongFields(head)) {
    const std::string expected =
        std::to_string(field.least) + (field.most > field.least ? " to " + std::to_string(field.most) : std::string());
    damage.push_back("the file's head, byte " + std::to_string(field.at) + " (" + field.name + "): is " +
                     std::to_string(valueOf(field, head)) + ", expected " + expected);
  }
  return damage;
}

bool mendHead(const std::string& path) {
  std::vector<char> head = firstBytesOf(path, kHead);
  for (const Field& field : wrongFields(head))
    for (size_t i = 0; i < field.bytes; ++i)
      head[field.at + i] = static_cast<char>(field.mended >> 8 * (field.bytes - 1 - i));
  std::error_code none;
  const auto log_bytes = std::filesystem::file_size(path + "-wal", none);
  if (!none && log_bytes > 0 && head.size() == kHead) head[18] = head[19] = 2;  // else its log would not be read
  return !head.empty() && overwriteStart(path, head);
}

std::vector<char> firstBytesOf(const std::string& path, size_t bytes) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return {};  // of a pipe the first byte would be waited for
  std::vector<char> start(bytes);
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(bytes));
  if (!file) start.clear();
  return start;
}

std::vector<char> firstPageOf(const std::string& path) {
  const std::vector<char> head = firstBytesOf(path, kHead);
  if (head.empty()) return {};
  const auto byteAt = [&](size_t at) { return static_cast<size_t>(static_cast<uint8_t>(head[at])); };
  const size_t told = byteAt(kPageSizeAt) << 8 | byteAt(kPageSizeAt + 1);
  return firstBytesOf(path, told == 1 ? 65536 : told);
}

bool overwriteStart(const std::string& path, const std::vector<char>& bytes) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return static_cast<bool>(file.flush());
}

std::vector<char> fitFirstPage(std::vector<char> page, const std::string& path) {
  std::error_code code;
  const uintmax_t bytes = std::filesystem::file_size(path, code);
  if (code || page.size() < kHead || bytes < 2 * page.size()) return {};
  const auto pages = static_cast<uint32_t>(bytes / page.size());
  for (size_t i = 0; i < 4; ++i) page[kPagesAt + i] = static_cast<char>(pages >> (24 - 8 * i));
  std::fill(page.begin() + kFreeAt, page.begin() + kFreeEnd, '\0');
  return page;
}

}  // namespace comap
