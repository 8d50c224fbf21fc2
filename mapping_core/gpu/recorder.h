// Collects dispatches, fills and copies and runs them in order in one submission. Each sees what those before it wrote.
#pragma once

#include <memory>
#include <type_traits>

#include "mapping_core/gpu/buffer.h"
#include "mapping_core/gpu/kernel.h"

namespace comap::gpu {

/// Buffers must live until submit() returns.
class Recorder {
 public:
  /// For at most `most_dispatches`.
  static Result<Recorder> begin(Context& context, uint32_t most_dispatches = 64);
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;
  ~Recorder();

  /// `groups` workgroups; none at all is a dispatch that does nothing.
  template <class Push>
  void dispatch(const Kernel& kernel, std::initializer_list<const Buffer*> buffers, const Push& push, uint32_t groups) {
    static_assert(std::is_trivially_copyable_v<Push> && sizeof(Push) <= 128);
    if (groups > 0) dispatch(kernel, buffers, &push, sizeof(Push), groups, nullptr);
  }
  /// As many workgroups as the first word of `groups` says when its turn comes; the two words after it must be 1.
  template <class Push>
  void dispatchIndirect(const Kernel& kernel, std::initializer_list<const Buffer*> buffers, const Push& push,
                        const Buffer& groups) {
    static_assert(std::is_trivially_copyable_v<Push> && sizeof(Push) <= 128);
    dispatch(kernel, buffers, &push, sizeof(Push), 0, &groups);
  }
  /// Sets the first `bytes` (a multiple of 4) to copies of `word`.
  void fill(const Buffer& buffer, uint32_t word, size_t bytes);
  void copy(const Buffer& from, const Buffer& to, size_t bytes, size_t to_offset = 0);

  /// Runs all and waits. kNoDevice if the device was lost, kOutOfMemory. The recorder is spent then.
  Result<void> submit();

 private:
  struct State;
  explicit Recorder(std::unique_ptr<State> state);
  void dispatch(const Kernel& kernel, std::initializer_list<const Buffer*> buffers, const void* push, size_t push_bytes,
                uint32_t groups, const Buffer* indirect_groups);
  std::unique_ptr<State> state_;
};

/// Workgroups of `per_group` items that cover `items`.
constexpr uint32_t groupsFor(size_t items, uint32_t per_group) {
  return static_cast<uint32_t>((items + per_group - 1) / per_group);
}

}  // namespace comap::gpu
