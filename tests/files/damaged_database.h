// Damage to a database's file, page by page.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "protocol/storage/database.h"

namespace comap {

inline constexpr std::streamoff kDatabasePage = 4096;  // SQLite's usual one

/// From 1 on; 0 if it has none, or the file cannot be read.
inline int64_t rootPageOf(const std::string& path, const std::string& table) {
  auto database = Database::open(path, SQLITE_OPEN_READWRITE);
  auto query = database->query("SELECT rootpage FROM sqlite_schema WHERE type = 'table' AND name = ?");
  if (!query) return 0;
  const auto row = query->bind(table).step();
  return row && *row ? query->integer() : 0;
}

/// The page that these bytes are on, as far as they are on one; 0 if they are nowhere.
inline int64_t pageOf(const std::string& path, std::span<const uint8_t> bytes) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<uint8_t> all{std::istreambuf_iterator<char>(file), {}};
  const auto at = std::search(all.begin(), all.end(), bytes.begin(), bytes.end());
  return at == all.end() ? 0 : (at - all.begin()) / kDatabasePage + 1;
}

inline void wipePage(const std::string& path, int64_t page) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp((page - 1) * kDatabasePage);
  const std::string rubbish(static_cast<size_t>(kDatabasePage), 'x');
  file.write(rubbish.data(), static_cast<std::streamsize>(rubbish.size()));
}

}  // namespace comap
