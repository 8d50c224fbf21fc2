// Where RGB-D frames come from, one after the other.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

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
};

}  // namespace comap
