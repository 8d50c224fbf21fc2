// Whether an open store is still the file of its name: one that was deleted or replaced takes all that is written, and
// is gone with the process.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>

namespace comap {

class StoreFile {
 public:
  /// `path`: of a store that is open. Its log, beside it, counts as soon as it is there.
  explicit StoreFile(std::string path);

  /// What has become of it; empty if it is what was opened. Takes microseconds.
  std::string trouble();

 private:
  using Identity = std::pair<dev_t, ino_t>;
  static std::optional<Identity> identityOf(const std::string& path);

  const std::string path_;
  std::optional<Identity> store_, log_;
};

}  // namespace comap
