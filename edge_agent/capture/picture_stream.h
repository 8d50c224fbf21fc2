// One stream of pictures from a device, colour or depth, and what may be wanted of it.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "edge_agent/capture/picture.h"
#include "protocol/types/result.h"

namespace comap {

/// What is wanted of a device; a zero leaves it to the device.
struct VideoWish {
  PictureKind kind = PictureKind::kColour;
  std::string format = "auto";  ///< auto, or as toString(PixelFormat) writes it
  int width = 0, height = 0;    ///< pixels
  double fps = 0;
};

struct VideoControls {
  static constexpr int kLeave = -1;
  int exposure_us = kLeave;  ///< 0 = the device finds it by itself
  int gain = kLeave;         ///< in the device's own unit
};

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
