// Files that appear together, or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

/// Files under other names until all are whole; what is left uncommitted goes, folders made for them too.
class StagedFiles {
 public:
  StagedFiles() = default;
  StagedFiles(const StagedFiles&) = delete;
  StagedFiles& operator=(const StagedFiles&) = delete;
  ~StagedFiles();

  /// kUnreachable if it is not there and cannot be made.
  Result<void> makeFolder(const std::filesystem::path& folder);
  /// The name to write `final` under until commit().
  std::string stage(const std::filesystem::path& final);
  /// The error with the final names in it, in place of those that nobody gave.
  Error named(Error error) const;
  /// kWrongUse if something else than a file is in the way; kUnreachable if a file cannot be put there.
  Result<void> commit();

 private:
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> files_;
  std::vector<std::filesystem::path> folders_;
};

}  // namespace comap
