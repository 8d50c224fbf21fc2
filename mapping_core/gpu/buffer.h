// A storage buffer in device memory.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "mapping_core/gpu/device.h"

namespace comap::gpu {

class Buffer {
 public:
  /// An empty handle, of 0 bytes.
  Buffer();
  /// Content is undefined. kOutOfMemory if it is larger than Device::maxBufferBytes() or does not fit into memory.
  /// `name` appears in errors and validation messages.
  static Result<Buffer> create(Context& context, size_t bytes, const char* name);
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;
  ~Buffer();

  size_t bytes() const;

  /// Waits until the bytes are in place; not while a Recorder that uses the buffer is unsubmitted.
  Result<void> write(const void* data, size_t bytes, size_t offset = 0);
  Result<void> read(void* data, size_t bytes, size_t offset = 0) const;

  template <class T>
  Result<void> write(std::span<const T> values, size_t first = 0) {
    static_assert(std::is_trivially_copyable_v<T>);
    return write(values.data(), values.size_bytes(), first * sizeof(T));
  }
  template <class T>
  Result<std::vector<T>> read(size_t count, size_t first = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> values(count);
    if (auto done = read(values.data(), count * sizeof(T), first * sizeof(T)); !done) return done.error();
    return values;
  }
  /// The device's memory itself, or nullptr where the host cannot see it (then use write() and read()).
  void* mapped() const;

  struct State;
  State* state() const { return state_.get(); }

 private:
  explicit Buffer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace comap::gpu
