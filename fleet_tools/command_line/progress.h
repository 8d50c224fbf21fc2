// What long work says of itself while it lasts.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace comap {

/// One line on stderr that is written over, with a share and the time that is left; nothing if stderr is no terminal.
/// The destructor clears it. Thread rule: one thread.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// `done` of `all`, which may have grown. Written at most ten times a second.
  void show(size_t done, size_t all);

 private:
  using Clock = std::chrono::steady_clock;
  const std::string what_;
  const bool terminal_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point shown_;
  bool any_ = false;
};

/// "1200 of 6000, 20 %, 3 min left", the time only once it can be told.
std::string progressText(size_t done, size_t all, double seconds);

}  // namespace comap
