// Where RGB-D frames come from, one after the other.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "edge_agent/capture/capture_health.h"
#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// The next frame, in order of time; nullopt = the source has ended. After an error the source may be asked again:
  /// it goes on with the frame after the damaged one. One thread at a time.
  virtual Result<std::optional<Frame>> next() = 0;

  /// Number of frames the source gives from start to end, 0 = unknown (a live camera).
  virtual size_t size() const = 0;

  /// What this is, for people: kind, place, range.
  virtual std::string description() const = 0;

  /// A camera: frames come whether they are taken or not, and never end.
  virtual bool live() const { return false; }

  /// Waits up to `timeout` until next() would return at once, and says whether it would.
  virtual bool ready(std::chrono::milliseconds /*timeout*/) { return true; }

  /// How a camera does; nothing for a recording.
  virtual std::optional<CaptureHealth> health() const { return std::nullopt; }
};

}  // namespace comap
