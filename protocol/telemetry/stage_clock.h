// Where a program's time goes: how often each stage of its work ran and how long, and if asked, each run of it as a bar
// on a time line (Chrome's trace format: chrome://tracing, ui.perfetto.dev).
#pragma once

#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "protocol/telemetry/time_histogram.h"
#include "protocol/types/result.h"

namespace comap {

/// One for the program, since stages lie deep in the work and say nothing that the work depends on.
/// Thread rule: any thread.
class StageClock {
 public:
  static StageClock& process();

  /// Whether a trace may be written there: kUnreachable of what would never end or begin, kWrongUse of what is
  /// something else's. Touches nothing.
  static Result<void> checkTrace(const std::string& path);

  /// From now on each span is also written to the file. Times in it are of the machine's steady clock, so that traces
  /// of several programs on it can be laid over each other. kUnreachable if it cannot be made.
  Result<void> traceTo(const std::string& path);
  /// Closes the file. kUnreachable if not all could be written.
  Result<void> endTrace();

  void add(const char* stage, std::chrono::steady_clock::time_point begin, std::chrono::steady_clock::time_point end);

  /// Something that happened now; only for the trace. `arguments`: a JSON object.
  void note(const char* event, const std::string& arguments);
  bool traces() const;  ///< whether note() is worth preparing arguments for

  std::map<std::string, TimeHistogram> times() const;

  StageClock() = default;
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  mutable std::mutex mutex_;
  std::map<std::string, TimeHistogram> times_;
  std::unique_ptr<std::FILE, Close> trace_;
  std::string trace_path_;
  bool first_ = true;
};

/// A stage runs for as long as this lives. `stage` must outlive the program: a literal.
class StageSpan {
 public:
  explicit StageSpan(const char* stage, StageClock& clock = StageClock::process())
      : clock_(clock), stage_(stage), begin_(std::chrono::steady_clock::now()) {}
  ~StageSpan() { clock_.add(stage_, begin_, std::chrono::steady_clock::now()); }
  StageSpan(const StageSpan&) = delete;
  StageSpan& operator=(const StageSpan&) = delete;

 private:
  StageClock& clock_;
  const char* stage_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace comap
