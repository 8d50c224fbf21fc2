#include <cstring>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr size_t kMessagesKept = 16;

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto& log = *static_cast<ValidationLog*>(user);
  ++log.count;
  if (log.messages.size() < kMessagesKept) log.messages.emplace_back(data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo(ValidationLog* log) {
  VkDebugUtilsMessengerCreateInfoEXT info{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT;
  // Only what the validation layer says: the loader's general messages concern the machine, not us.
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  info.pfnUserCallback = onMessage;
  info.pUserData = log;
  return info;
}

bool hasValidationLayer() {
  uint32_t count = 0;
  if (vkEnumerateInstanceLayerProperties(&count, nullptr) != VK_SUCCESS) return false;
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  for (const auto& layer : layers) {
    if (std::strcmp(layer.layerName, kValidationLayer) == 0) return true;
  }
  return false;
}

}  // namespace

Result<std::unique_ptr<Instance>> Instance::create(bool validation) {
  auto instance = std::make_unique<Instance>();
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.pApplicationName = "comap";
  application.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  info.pApplicationInfo = &application;
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  const auto messenger_info = messengerInfo(instance->log.get());
  if (validation) {
    if (!hasValidationLayer()) {
      return Error{ErrorCode::kNoDevice, std::string("Vulkan: validation was asked for, but the layer ") +
                                             kValidationLayer +
                                             " is not installed (Debian package vulkan-validationlayers)"};
    }
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &extension;
    info.pNext = &messenger_info;
  }
  if (const VkResult result = vkCreateInstance(&info, nullptr, &instance->handle); result != VK_SUCCESS) {
    return vulkanError(result, "creating an instance (is a driver such as mesa-vulkan-drivers installed?)");
  }
  if (validation) {
    const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance->handle, "vkCreateDebugUtilsMessengerEXT"));
    const VkResult result = create ? create(instance->handle, &messenger_info, nullptr, &instance->messenger)
                                   : VK_ERROR_EXTENSION_NOT_PRESENT;
    if (result != VK_SUCCESS) return vulkanError(result, "creating the validation messenger");
  }
  return instance;
}

Instance::~Instance() {
  if (messenger) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(handle, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(handle, messenger, nullptr);
  }
  if (handle) vkDestroyInstance(handle, nullptr);
}

}  // namespace comap::gpu
