// One OpenNI2 device and its streams; the only header that sees OpenNI2's own.
#pragma once

#include <OpenNI.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "edge_agent/capture/device_clock.h"
#include "edge_agent/capture/openni2.h"

namespace comap::openni2_detail {

/// Says what OpenNI2 says was wrong.
Error problem(ErrorCode code, const std::string& doing);

/// Starts OpenNI2 once for the process. It stays until the process ends, as its plug-ins' threads may.
Result<void> startLibrary();

/// Does `task` on a thread that lives as long as the process, and waits for it: OpenNI2 remembers each thread that has
/// ever called it, and crashes on one that has ended. For all that is called from other threads than the main one.
void onLibraryThread(const std::function<void()>& task);

/// An open device; its streams share it. Destroyed by any thread.
class Device final : public openni::OpenNI::DeviceDisconnectedListener {
 public:
  static Result<std::shared_ptr<Device>> open(const std::string& uri);
  ~Device() override;

  void onDeviceDisconnected(const openni::DeviceInfo* info) override;

  bool gone() const { return gone_; }
  const std::string& uri() const { return uri_; }
  openni::Device& device() { return device_; }
  DeviceClock& clock() { return clock_; }

 private:
  Device() = default;
  std::string uri_;
  openni::Device device_;
  DeviceClock clock_;
  std::atomic<bool> gone_ = false;
};

/// A stream that has a mode and is not started yet. A mode's width or height of 0 in the wish: any.
struct ReadyStream {
  std::unique_ptr<openni::VideoStream> stream;
  openni::VideoMode mode = {};
  PixelFormat format = PixelFormat::kRgb3;
  double units_per_m = 0;  ///< of depth
};
Result<ReadyStream> prepare(Device& device, const VideoWish& wish);

/// The lens that the stream tells of, without distortion.
Lens lensOf(const openni::VideoStream& stream);

/// A copy of the frame with the device's stamp.
Picture pictureOf(const openni::VideoFrameRef& frame, PixelFormat format);

}  // namespace comap::openni2_detail
