#include <string>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

const char* nameOf(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory";
    case VK_ERROR_DEVICE_LOST:
      return "device lost";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "initialisation failed";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "extension not present";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no compatible driver (ICD) found";
    case VK_ERROR_TOO_MANY_OBJECTS:
      return "too many objects";
    default:
      return "failed";
  }
}

}  // namespace

Error vulkanError(VkResult result, const std::string& what) {
  const bool memory = result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY ||
                      result == VK_ERROR_OUT_OF_POOL_MEMORY || result == VK_ERROR_TOO_MANY_OBJECTS;
  return {memory ? ErrorCode::kOutOfMemory : ErrorCode::kNoDevice,
          "Vulkan: " + what + ": " + nameOf(result) + " (VkResult " + std::to_string(result) + ")"};
}

}  // namespace comap::gpu
