// A store that is being made: under another name until all of it is there, as half of it would look like a whole one.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Whatever is not published goes with this object.
class StoreDraft {
 public:
  /// For the store `path`, made from what is in `source`. kWrongUse if there is such a store or something else where it
  /// is made; kUnreachable if its folder is not there, or another program makes it just now. What an interrupted one
  /// has left is taken away.
  static Result<StoreDraft> begin(const std::string& path, const std::string& source);
  StoreDraft(StoreDraft&& other) noexcept;
  StoreDraft& operator=(StoreDraft&&) = delete;
  ~StoreDraft();

  /// Where it is made.
  std::string path() const { return store_ + ".part"; }
  /// A copy of the source, in which the change is taken back that its writer was killed within: beside the draft, and
  /// gone with it. The source stays as it is.
  Result<std::string> copySource() const;
  /// Gives it its name, durably. What has come to be there meanwhile is not written over.
  Result<void> publish();

 private:
  StoreDraft(std::string store, std::string source, int lock)
      : store_(std::move(store)), source_(std::move(source)), lock_(lock) {}
  std::string copyPath() const { return store_ + ".part-source"; }
  std::string store_, source_;
  int lock_;  // of a file beside it, which SQLite knows nothing of
};

}  // namespace comap
