#include "mapping_core/store/store_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace comap {

Result<StoreLock> StoreLock::take(const std::string& path, bool create) {
  // Of a pipe, a writer is not waited for.
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | (create ? O_CREAT : 0), 0644);
  if (file < 0) return Error{ErrorCode::kUnreachable, path + ": " + std::strerror(errno)};
  if (flock(file, LOCK_EX | LOCK_NB) != 0) {
    close(file);
    return Error{ErrorCode::kUnreachable,
                 path +
                     ": another program has it: a running mapping core, a replay, or a fleet verb "
                     "that changes or saves it"};
  }
  return StoreLock(file);
}

StoreLock& StoreLock::operator=(StoreLock&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

StoreLock::~StoreLock() {
  if (file_ >= 0) close(file_);
}

}  // namespace comap
