#include "fleet_tools/store/store_draft.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "mapping_core/store/store_leavings.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

std::string lockPath(const std::string& store) { return store + ".part-lock"; }

void removeStore(const std::string& path) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm", "-journal"}) fs::remove(path + part, ignored);
}

Result<void> checkFolder(const std::string& path) {
  std::error_code code;
  const fs::path folder = fs::absolute(path, code).parent_path();
  if (fs::is_directory(folder, code)) return {};
  return Error{ErrorCode::kUnreachable, "--out " + path + ": folder " + folder.string() + " does not exist"};
}

// Also no log of a store that is gone: SQLite would take what is in it for the new one's.
Result<void> checkFree(const std::string& path) {
  for (const char* part : {"", "-wal", "-shm"}) {
    std::error_code code;
    if (!fs::exists(fs::symlink_status(path + part, code))) continue;
    const std::string what = *part == '\0' ? ": is there already; choose a new name"
                                           : ": " + path + part + " is there, of another store; choose a new name";
    return Error{ErrorCode::kWrongUse, "--out " + path + what};
  }
  return {};
}

// What an interrupted run has left is begun anew; anything else of that name is somebody's.
Result<void> checkDraft(const std::string& store, const std::string& draft) {
  std::error_code code;
  const auto there = fs::symlink_status(draft, code);
  if (!fs::exists(there)) return {};
  constexpr std::string_view kMagic = "SQLite format 3";
  std::string start(kMagic.size(), '\0');
  if (fs::is_regular_file(there)) {
    std::ifstream file(draft, std::ios::binary);
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<size_t>(file.gcount()));
    // SQLite writes the first page last: until then it is a hole.
    if (start == kMagic || start.find_first_not_of('\0') == std::string::npos) return {};
  }
  return Error{ErrorCode::kWrongUse, "--out " + store + ": is made as " + draft +
                                         " first, and what is there is no half of a store; choose another name"};
}

// Whoever ends takes the file away: one that was taken away meanwhile locks nothing.
Result<int> takeLock(const std::string& store) {
  const std::string path = lockPath(store);
  for (;;) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0) return Error{ErrorCode::kUnreachable, "--out " + store + ": " + path + ": " + std::strerror(errno)};
    if (flock(file, LOCK_EX | LOCK_NB) != 0) {
      close(file);
      return Error{ErrorCode::kUnreachable, "--out " + store + ": another fleet recover is making it"};
    }
    struct stat held {
    }, there{};
    if (fstat(file, &held) == 0 && held.st_size > 0) {
      close(file);
      return Error{ErrorCode::kWrongUse, "--out " + store + ": " + path + " is there, and is none of fleet's"};
    }
    if (fstat(file, &held) == 0 && stat(path.c_str(), &there) == 0 && held.st_ino == there.st_ino) return file;
    close(file);
  }
}

// A name that outlives a loss of power must not be that of half a file.
Result<void> synchronise(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = file >= 0 && fsync(file) == 0;
  const int why = errno;
  if (file >= 0) close(file);
  return done ? Result<void>()
              : Error{ErrorCode::kUnreachable, path + ": cannot be synchronised: " + std::strerror(why)};
}

}  // namespace

Result<StoreDraft> StoreDraft::begin(const std::string& path, const std::string& source) {
  if (auto folder = checkFolder(path); !folder) return folder.error();
  if (auto free = checkFree(path); !free) return free.error();
  for (const char* suffix : {".part", ".part-source"}) {
    std::error_code none;
    if (fs::equivalent(source, path + suffix, none))
      return Error{ErrorCode::kWrongUse, "--out " + path + ": is made as " + source +
                                             " first, which is the damaged store; choose another name"};
    if (auto free = checkDraft(path, path + suffix); !free) return free.error();
  }
  const auto lock = takeLock(path);
  if (!lock) return lock.error();
  StoreDraft draft(path, source, *lock);
  removeStore(draft.path());
  removeStore(draft.copyPath());
  return draft;
}

StoreDraft::StoreDraft(StoreDraft&& other) noexcept
    : store_(std::move(other.store_)), source_(std::move(other.source_)), lock_(std::exchange(other.lock_, -1)) {}

StoreDraft::~StoreDraft() {
  if (lock_ < 0) return;
  removeStore(path());
  removeStore(copyPath());
  unlink(lockPath(store_).c_str());
  close(lock_);
}

Result<std::string> StoreDraft::copySource() const {
  for (const char* part : {"", "-wal", "-journal"}) {
    std::error_code code;
    if (!fs::exists(source_ + part, code)) continue;
    fs::copy_file(source_ + part, copyPath() + part, code);
    if (code)
      return Error{ErrorCode::kUnreachable,
                   source_ + part + ": cannot be copied to " + copyPath() + part + ": " + code.message()};
  }
  (void)takeBackHalfChange(copyPath());  // one that cannot be is told by whoever reads the copy
  return copyPath();
}

Result<void> StoreDraft::publish() {
  if (auto free = checkFree(store_); !free) return free;
  if (auto durable = synchronise(path()); !durable) return durable;
  if (renameat2(AT_FDCWD, path().c_str(), AT_FDCWD, store_.c_str(), RENAME_NOREPLACE) == 0) return {};
  if (errno == EINVAL && std::rename(path().c_str(), store_.c_str()) == 0) return {};  // without that flag
  return Error{ErrorCode::kUnreachable, path() + ": cannot be renamed to " + store_ + ": " + std::strerror(errno)};
}

}  // namespace comap
