// What a program says while it runs: one line each, for people or for a log collector.
#pragma once

#include <cstdio>
#include <string>

namespace comap {

enum class LogFormat {
  kText,  ///< the line as it is
  kJson,  ///< {"time":"2026-01-31T12:00:00.000Z","program":...,"level":...,"text":...}
};

enum class LogLevel {
  kInfo,
  kError,  ///< somebody should look
};

/// Writes to `out`, a line at a time. Thread rule: any thread.
class Log {
 public:
  Log(LogFormat format, std::string program, std::FILE* out = stderr)
      : format_(format), program_(std::move(program)), out_(out) {}

  void info(const std::string& text) const { write(LogLevel::kInfo, text); }
  void error(const std::string& text) const { write(LogLevel::kError, text); }
  /// As text, the program's name stands before an error.
  void write(LogLevel level, const std::string& text) const;

 private:
  LogFormat format_;
  std::string program_;
  std::FILE* out_;
};

}  // namespace comap
