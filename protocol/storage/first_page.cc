#include "protocol/storage/first_page.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>

namespace comap {
namespace {

// sqlite.org/fileformat2.html, 1.3
constexpr size_t kPageSizeAt = 16, kPagesAt = 28, kFreeAt = 32, kFreeEnd = 40, kHead = 100;

}  // namespace

std::vector<char> firstBytesOf(const std::string& path, size_t bytes) {
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
