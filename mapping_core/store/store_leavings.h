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

/// Who only reads a store that was not closed makes a log beside it, and cannot delete it. Takes an empty one away,
/// unless a program has the store open.
void dropEmptyLog(const std::string& path);

/// Calls dropEmptyLog() at its end.
class EmptyLogGuard {
 public:
  explicit EmptyLogGuard(std::string path) : path_(std::move(path)) {}
  EmptyLogGuard(const EmptyLogGuard&) = delete;
  EmptyLogGuard& operator=(const EmptyLogGuard&) = delete;
  ~EmptyLogGuard() { dropEmptyLog(path_); }

 private:
  const std::string path_;
};

}  // namespace comap
