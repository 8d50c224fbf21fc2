// A compute shader ready to run.
#pragma once

#include <cstdint>
#include <span>

#include "mapping_core/gpu/device.h"

namespace comap::gpu {

/// What the build makes of one file in shaders/.
struct KernelSource {
  const char* name;                ///< unique
  std::span<const uint32_t> code;  ///< SPIR-V
  uint32_t bindings;               ///< buffers at set 0, binding 0 .. bindings - 1; how the kernel sees each is its own
  uint32_t push_bytes;             ///< of the push-constant block, at most 128
};

struct Kernel;

/// Compiles at first use and keeps it with the device; the pointer lives as long as the device.
Result<const Kernel*> findKernel(Context& context, const KernelSource& source);

}  // namespace comap::gpu
