// What programs leave beside a store: the journal of a change that was half done, and logs of those who only read.
#pragma once

#include <string>

namespace comap {

/// Whether there is a journal. Who was killed while it opened or closed the store has left its last change half done;
/// while a program is at it, there is one as well.
bool hasJournal(const std::string& path);

/// SQLite takes a half change back for whoever may write; a program that only reads would be refused. Nothing else is
/// written. Returns whether there was one and it is gone.
bool takeBackHalfChange(const std::string& path);

/// Who only reads a store that was not closed makes a log beside it, or an index (`-shm`) of the log that is there, and
/// cannot delete them. Takes away, at its end, a log that is empty, and an index that was not there at its beginning,
/// unless a program has the store open. Must outlive this program's connections to the store, and no lock of this
/// program's may outlive it.
class LeavingsGuard {
 public:
  explicit LeavingsGuard(std::string path);
  LeavingsGuard(const LeavingsGuard&) = delete;
  LeavingsGuard& operator=(const LeavingsGuard&) = delete;
  ~LeavingsGuard();

 private:
  const std::string path_;
  const bool had_index_;
};

}  // namespace comap
