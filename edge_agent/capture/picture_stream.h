// One stream of pictures from a device, colour or depth.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "edge_agent/capture/picture.h"
#include "protocol/types/result.h"

namespace comap {

class PictureStream {
 public:
  virtual ~PictureStream() = default;

  /// Waits up to `timeout` for the next picture; nullopt = none came. kBadData: that one was damaged, ask again;
  /// kUnreachable: the device is gone or has changed, this stream gives nothing any more. One thread at a time.
  virtual Result<std::optional<Picture>> take(std::chrono::milliseconds timeout) = 0;

  /// Device, format, size and rate, for people.
  virtual std::string description() const = 0;
};

/// Opens the device, as it does again after the device was gone.
using StreamOpener = std::function<Result<std::unique_ptr<PictureStream>>()>;

}  // namespace comap
