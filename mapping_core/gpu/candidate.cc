#include <algorithm>
#include <charconv>
#include <optional>

#include "mapping_core/gpu/context.h"
#include "mapping_core/gpu/device_choice.h"

namespace comap::gpu {
namespace {

const char* typeName(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    default:
      return "other";
  }
}

int rank(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 3;
    default:
      return 4;
  }
}

struct QueueFamily {
  uint32_t index = 0, timestamp_bits = 0;
};

std::optional<QueueFamily> computeQueueFamily(VkPhysicalDevice device) {
  uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (uint32_t i = 0; i < count; ++i) {
    if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return QueueFamily{i, families[i].timestampValidBits};
  }
  return std::nullopt;
}

std::string describeAll(const std::vector<Candidate>& candidates) {
  std::string text;
  for (const auto& candidate : candidates) {
    text += "; " + std::to_string(candidate.info.index) + ": " + candidate.info.name + " (" + candidate.info.type + ")";
    if (!candidate.info.refusal.empty()) text += " refused, it " + candidate.info.refusal;
  }
  return text;
}

}  // namespace

std::string refusalOf(const VkPhysicalDeviceProperties& properties, bool has_compute_queue) {
  const auto& limits = properties.limits;
  const auto tooSmall = [](const char* limit, uint64_t found, uint64_t needed) {
    return std::string(limit) + " is " + std::to_string(found) + ", needed " + std::to_string(needed);
  };
  if (properties.apiVersion < VK_API_VERSION_1_1) {
    return "supports Vulkan " + std::to_string(VK_API_VERSION_MAJOR(properties.apiVersion)) + "." +
           std::to_string(VK_API_VERSION_MINOR(properties.apiVersion)) + ", needed 1.1";
  }
  if (!has_compute_queue) return "has no compute queue";
  if (limits.maxPerStageDescriptorStorageBuffers < 8) {
    return tooSmall("maxPerStageDescriptorStorageBuffers", limits.maxPerStageDescriptorStorageBuffers, 8);
  }
  if (limits.maxComputeWorkGroupInvocations < 128) {
    return tooSmall("maxComputeWorkGroupInvocations", limits.maxComputeWorkGroupInvocations, 128);
  }
  if (limits.maxComputeSharedMemorySize < 16384) {
    return tooSmall("maxComputeSharedMemorySize", limits.maxComputeSharedMemorySize, 16384);
  }
  if (limits.maxTexelBufferElements < (1u << 22)) {
    return tooSmall("maxTexelBufferElements", limits.maxTexelBufferElements, 1u << 22);
  }
  if (limits.maxStorageBufferRange < (1u << 27)) {
    return tooSmall("maxStorageBufferRange", limits.maxStorageBufferRange, 1u << 27);
  }
  return {};
}

Result<std::vector<Candidate>> findCandidates(VkInstance instance) {
  uint32_t count = 0;
  VkResult result = vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> handles(count);
  if (result == VK_SUCCESS) result = vkEnumeratePhysicalDevices(instance, &count, handles.data());
  if (result != VK_SUCCESS) return vulkanError(result, "listing devices");
  std::vector<Candidate> candidates(count);
  for (uint32_t i = 0; i < count; ++i) {
    auto& candidate = candidates[i];
    candidate.handle = handles[i];
    vkGetPhysicalDeviceProperties(handles[i], &candidate.properties);
    const auto family = computeQueueFamily(handles[i]);
    const auto [index, timestamp_bits] = family.value_or(QueueFamily{});
    candidate.queue_family = index;
    candidate.timestamp_bits = timestamp_bits;
    candidate.info = {i, candidate.properties.deviceName, typeName(candidate.properties.deviceType),
                      refusalOf(candidate.properties, family.has_value())};
  }
  return candidates;
}

Result<size_t> chooseCandidate(const std::vector<Candidate>& candidates, const std::string& choice) {
  if (candidates.empty()) return Error{ErrorCode::kNoDevice, "Vulkan: no device found by any installed driver"};
  std::vector<size_t> usable;
  if (choice == "auto" || choice == "llvmpipe") {
    for (size_t i = 0; i < candidates.size(); ++i) {
      const bool named = choice == "auto" || candidates[i].info.name.find("llvmpipe") != std::string::npos;
      if (named && candidates[i].info.refusal.empty()) usable.push_back(i);
    }
  } else {
    if (const std::string problem = choiceProblem(choice); !problem.empty())
      return Error{ErrorCode::kWrongUse, "device " + problem};
    uint32_t index = 0;
    std::from_chars(choice.data(), choice.data() + choice.size(), index);
    if (index < candidates.size() && candidates[index].info.refusal.empty()) usable.push_back(index);
  }
  if (usable.empty()) {
    return Error{ErrorCode::kNoDevice, "Vulkan: no usable device for '" + choice + "'" + describeAll(candidates)};
  }
  return *std::min_element(usable.begin(), usable.end(), [&](size_t a, size_t b) {
    return rank(candidates[a].properties.deviceType) < rank(candidates[b].properties.deviceType);
  });
}

Result<std::vector<DeviceInfo>> listDevices() {
  auto instance = Instance::create(false);
  if (!instance) return instance.error();
  auto candidates = findCandidates((*instance)->handle);
  if (!candidates) return candidates.error();
  std::vector<DeviceInfo> infos;
  for (const auto& candidate : *candidates) infos.push_back(candidate.info);
  return infos;
}

}  // namespace comap::gpu
