// Whether the store takes what it is given, and keeps it: a disk may be full, and may have room again; a file may be
// deleted or replaced, and put back.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "mapping_core/service/store_file.h"
#include "mapping_core/store/map_store.h"
#include "protocol/telemetry/log.h"

namespace comap {

/// Thread rule: as the store's.
class StoreHealth {
 public:
  using Log = std::function<void(LogLevel level, const std::string& line)>;

  /// `log` is told when it takes no more, and when it takes again.
  StoreHealth(MapStore& store, Log log) : store_(store), file_(store.path()), log_(std::move(log)) {}

  /// Whether what is written is in the file of the store's name. Ask before anything is acknowledged.
  bool holds();
  /// Whether to write now. After a failure the store is tried once a second, with as much as failed.
  bool takes();
  bool refuses() const { return !failure_.empty(); }
  /// Why it refuses; empty if it does not.
  const std::string& failure() const { return failure_; }
  /// What came of an attempt to write; `bytes` of it, if known.
  void note(const Result<void>& written, size_t bytes = 0);

 private:
  MapStore& store_;
  StoreFile file_;
  Log log_;
  std::string failure_;
  size_t room_ = 256 << 10;  // about a keyframe: what must fit before the store counts as mended
  std::chrono::steady_clock::time_point tried_{};
};

}  // namespace comap
