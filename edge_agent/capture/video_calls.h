// What is asked of the operating system for a video device; tests put a device of their own in its place.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace comap {

class VideoCalls {
 public:
  virtual ~VideoCalls() = default;
  /// Without blocking mode. Descriptor, or -errno.
  virtual int open(const std::string& path) = 0;
  virtual void close(int descriptor) = 0;
  /// ioctl, repeated where a signal interrupts it. 0 or -errno.
  virtual int control(int descriptor, unsigned long request, void* argument) = 0;
  /// Shared and writable, as the interface wants it; nullptr if it cannot be mapped.
  virtual void* map(int descriptor, size_t length, int64_t offset) = 0;
  virtual void unmap(void* memory, size_t length) = 0;
  /// poll for pictures and events: its revents, 0 after `timeout`, or -errno.
  virtual int wait(int descriptor, std::chrono::milliseconds timeout) = 0;
  /// The video devices there are, in order of their numbers.
  virtual std::vector<std::string> nodes() = 0;
};

/// The running kernel's. May be used from any thread.
VideoCalls& systemVideoCalls();

}  // namespace comap
