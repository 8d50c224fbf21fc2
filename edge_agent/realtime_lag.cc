#include "edge_agent/realtime_lag.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace comap {

std::optional<std::string> RealtimeLag::note(std::chrono::nanoseconds behind, uint32_t frames) {
  most_ = std::max(most_, behind);
  if (behind < next_told_) return std::nullopt;
  next_told_ = 2 * behind;
  return fmt::format(
      "{:.1f} s behind the recording's own speed after {} frames: this machine does not keep up with --realtime. No "
      "frame "
      "is left out, they come late (--threads, --preload and a larger camera.shrink make it quicker)",
      std::chrono::duration<double>(behind).count(), frames);
}

}  // namespace comap
