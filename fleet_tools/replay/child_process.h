// A program started by this one, which does not outlive it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

class ChildProcess {
 public:
  /// Starts `program` (a path) with output and errors going to the file `log`. kUnreachable if it cannot be started;
  /// `package` brings it.
  static Result<ChildProcess> start(const std::string& program, const std::vector<std::string>& arguments,
                                    const std::string& log, const std::string& package);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  /// Ends it if it still runs: asks, and after 5 s forces.
  ~ChildProcess();

  /// Its exit code once it has ended, 128 + signal if it was killed; nothing while it runs.
  std::optional<int> exitCode();
  /// Asks it to end (SIGTERM) and waits. Its exit code, or nothing if it goes on beyond `patience`.
  std::optional<int> stop(std::chrono::seconds patience);

  /// The last lines of its log, for an error message.
  std::string lastWords() const;

 private:
  ChildProcess(pid_t pid, std::string log) : pid_(pid), log_(std::move(log)) {}
  pid_t pid_;
  std::string log_;
  std::optional<int> exit_code_;
};

/// The folder this program's executable stands in.
std::string programFolder();

}  // namespace comap
