#include "mapping_core/store/store_leavings.h"

#include <filesystem>

#include "protocol/storage/database.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// Opens and closes it as one that may write, which changes nothing of a store that is whole.
void touch(const std::string& path) {
  if (auto database = Database::open(fs::absolute(path).string(), SQLITE_OPEN_READWRITE))
    (void)database->integer("PRAGMA user_version");
}

}  // namespace

bool hasJournal(const std::string& path) {
  std::error_code none;
  const auto bytes = fs::file_size(path + "-journal", none);
  return !none && bytes > 0;
}

bool takeBackHalfChange(const std::string& path) {
  if (!hasJournal(path)) return false;
  touch(path);
  return !hasJournal(path);
}

void dropEmptyLog(const std::string& path) {
  std::error_code none;
  const auto bytes = fs::file_size(path + "-wal", none);
  if (!none && bytes == 0 && !hasJournal(path)) touch(path);  // the last one to close a store deletes its log
}

}  // namespace comap
