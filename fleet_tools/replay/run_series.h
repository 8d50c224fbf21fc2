// Several runs in one folder, one after the other: those that are finished are kept when the same command comes again.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "mapping_core/store/store_lock.h"
#include "protocol/types/result.h"

namespace comap {

/// Holds its folder: no other program works on the same runs meanwhile.
class RunSeries {
 public:
  /// `plan`: an object of all that decides what comes out of the runs, but not how many there are. A folder that holds
  /// runs of the same plan is gone on with, any other one made as prepareRunFolder does. kWrongUse for runs of another
  /// plan, unless `overwrite`; kUnreachable if another program is at it.
  static Result<RunSeries> begin(const std::string& out, const nlohmann::json& plan, bool overwrite);

  /// How many runs were finished before this program came.
  size_t finishedBefore() const { return finished_before_; }

  /// A folder within it that only holds runs.
  Result<void> addFolder(const std::string& folder);
  /// The exit code of the run in `folder` if that is finished. If not, the folder is there and empty afterwards.
  Result<std::optional<int>> takeUp(const std::string& folder);
  /// All that the run in `folder` comes to is written.
  Result<void> finish(const std::string& folder, int exit_code);

 private:
  RunSeries(StoreLock lock, size_t finished_before) : lock_(std::move(lock)), finished_before_(finished_before) {}
  StoreLock lock_;
  size_t finished_before_;
};

}  // namespace comap
