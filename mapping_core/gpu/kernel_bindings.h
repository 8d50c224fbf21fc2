// What a kernel's bindings are, read from its SPIR-V. For this folder's sources only.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <vector>

namespace comap::gpu {

/// How one binding looks at its buffer.
struct BindingKind {
  VkDescriptorType type = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  VkFormat format = VK_FORMAT_UNDEFINED;  ///< of texel buffers: what one fetch gives
};

/// By binding, 0 .. bindings - 1. `samplerBuffer` and `usamplerBuffer` fetch four words, `uimageBuffer` one; all
/// others are storage buffers.
std::vector<BindingKind> bindingKinds(std::span<const uint32_t> code, uint32_t bindings);

}  // namespace comap::gpu
