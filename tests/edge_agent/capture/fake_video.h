// Video devices that exist only here: what a driver does, under a test's control.
#pragma once

#include <linux/videodev2.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "edge_agent/capture/video_calls.h"

namespace comap {

struct FakeMode {
  uint32_t fourcc;
  uint32_t width, height, fps;
};

struct FakePicture {
  std::vector<uint8_t> bytes;
  uint32_t sequence = 0;
  int64_t stamp_ns = 0;
  uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  uint32_t bytes_used = 0;  ///< 0: as many as there are
};

struct FakeDevice {
  std::string card = "Fake camera";
  uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<FakeMode> modes;
  std::map<uint32_t, v4l2_queryctrl> controls;  ///< by id; default_value holds what was set last
  uint32_t buffer_bytes = 1 << 16;
  uint32_t forced_width = 0;        ///< the driver insists on this width
  uint8_t planes = 1;               ///< of a device that speaks the multi-plane interface
  uint32_t multi_plane_stride = 0;  ///< its bytes in a line
  uint32_t data_offset = 0;         ///< and where its pictures begin
  bool busy = false;                ///< another program streams
  std::deque<FakePicture> waiting;  ///< pictures taken but not delivered yet
  std::deque<int> failures;         ///< errnos of the next dequeues
  bool changed = false;             ///< an event of a changed source waits
  // What the program did.
  uint32_t width = 0, height = 0, fourcc = 0;
  bool streaming = false;
};

/// Any thread.
class FakeVideo final : public VideoCalls {
 public:
  /// Plugs a device in; `make` may set it up.
  void plug(const std::string& path, FakeDevice device);
  /// Takes it away while it may be in use.
  void unplug(const std::string& path);
  void deliver(const std::string& path, FakePicture picture);
  void failNext(const std::string& path, int error);
  void changeSource(const std::string& path);
  FakeDevice look(const std::string& path) const;
  int openDescriptors() const;
  int mappings() const;

  int open(const std::string& path) override;
  void close(int descriptor) override;
  int control(int descriptor, unsigned long request, void* argument) override;
  void* map(int descriptor, size_t length, int64_t offset) override;
  void unmap(void* memory, size_t length) override;
  int wait(int descriptor, std::chrono::milliseconds timeout) override;
  std::vector<std::string> nodes() override;

 private:
  struct Opened {
    std::string path;
    std::shared_ptr<FakeDevice> device;  // gone from devices_ once unplugged
    std::vector<std::vector<uint8_t>> memory;
    std::deque<uint32_t> queued;
  };
  bool gone(const Opened& opened) const;
  static bool isMultiPlane(const FakeDevice& device);
  static uint32_t typeOf(const FakeDevice& device);
  int setFormat(Opened& opened, v4l2_format& format);
  int dequeue(Opened& opened, v4l2_buffer& buffer);

  mutable std::mutex mutex_;
  std::condition_variable bell_;
  std::map<std::string, std::shared_ptr<FakeDevice>> devices_;
  std::map<int, Opened> opened_;
  int next_descriptor_ = 100, mappings_ = 0;
};

}  // namespace comap
