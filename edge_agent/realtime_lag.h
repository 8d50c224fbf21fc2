// How far a recording that is played at its own speed is behind it, and when to say so.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace comap {

/// Thread rule: one thread.
class RealtimeLag {
 public:
  /// A frame was done so long after it was due; the `frames`th. Returns what to say: once it is a second, and whenever
  /// it has doubled since.
  std::optional<std::string> note(std::chrono::nanoseconds behind, uint32_t frames);
  double most_s() const { return std::chrono::duration<double>(most_).count(); }

 private:
  std::chrono::nanoseconds most_{0}, next_told_ = std::chrono::seconds(1);
};

}  // namespace comap
