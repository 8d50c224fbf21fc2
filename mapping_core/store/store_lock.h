// One writer a store: two cores on one file would overwrite each other's maps without a word.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Held as long as this object lives, and let go by the system if the process dies. Whoever reads the file through
/// SQLite takes it before the file is opened and lets go of it after the file is closed.
class StoreLock {
 public:
  /// kUnreachable if another process, or another lock of this one, holds the store at `path`, or if there is none:
  /// with `create`, an empty file is then made.
  static Result<StoreLock> take(const std::string& path, bool create = false);
  StoreLock(StoreLock&& other) noexcept : file_(other.file_) { other.file_ = -1; }
  StoreLock& operator=(StoreLock&& other) noexcept;
  ~StoreLock();

 private:
  explicit StoreLock(int file) : file_(file) {}
  int file_;
};

}  // namespace comap
