#include "mapping_core/store/store_leavings.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "mapping_core/store/store_lock.h"
#include "protocol/storage/database.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// Opens and closes it as one that may write, which changes nothing of a store that is whole.
void touch(const std::string& path) {
  if (auto database = Database::open(fs::absolute(path).string(), SQLITE_OPEN_READWRITE))
    (void)database->integer("PRAGMA user_version");
}

std::string indexOf(const std::string& path) { return path + "-shm"; }

bool isThere(const std::string& path) {
  std::error_code none;
  return fs::exists(path, none);
}

void dropEmptyLog(const std::string& path) {
  std::error_code none;
  const auto bytes = fs::file_size(path + "-wal", none);
  if (!none && bytes == 0 && !hasJournal(path)) touch(path);  // the last one to close a store deletes its log
}

// Whoever has a store open with a log holds one of these bytes of the log's index (SQLite's WAL-index locks).
bool isInUse(int index) {
  struct flock asked {};
  asked.l_type = F_WRLCK;
  asked.l_whence = SEEK_SET;
  asked.l_start = 120;
  asked.l_len = 9;
  return fcntl(index, F_GETLK, &asked) != 0 || asked.l_type != F_UNLCK;
}

// With the store's lock, so that no writer comes meanwhile.
void dropIdleIndex(const std::string& path) {
  if (!isThere(indexOf(path))) return;
  const auto lock = StoreLock::take(path);
  if (!lock) return;
  const int index = open(indexOf(path).c_str(), O_RDWR | O_CLOEXEC);
  if (index < 0) return;
  if (!isInUse(index)) unlink(indexOf(path).c_str());
  close(index);
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

LeavingsGuard::LeavingsGuard(std::string path) : path_(std::move(path)), had_index_(isThere(indexOf(path_))) {}

LeavingsGuard::~LeavingsGuard() {
  dropEmptyLog(path_);
  if (!had_index_) dropIdleIndex(path_);
}

}  // namespace comap
