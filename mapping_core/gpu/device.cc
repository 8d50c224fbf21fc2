#include "mapping_core/gpu/device.h"

#include <limits>

#include "mapping_core/gpu/context.h"
#include "mapping_core/gpu/pipeline_cache.h"

namespace comap::gpu {
namespace {

Result<void> createLogicalDevice(Context& context) {
  const float priority = 1.0f;
  VkDeviceQueueCreateInfo queue_info{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queue_info.queueFamilyIndex = context.physical.queue_family;
  queue_info.queueCount = 1;
  queue_info.pQueuePriorities = &priority;
  VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue_info;
  VkResult result = vkCreateDevice(context.physical.handle, &info, nullptr, &context.device);
  if (result != VK_SUCCESS) return vulkanError(result, "creating device " + context.physical.info.name);
  vkGetDeviceQueue(context.device, context.physical.queue_family, 0, &context.queue);

  VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool_info.queueFamilyIndex = context.physical.queue_family;
  pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  result = vkCreateCommandPool(context.device, &pool_info, nullptr, &context.command_pool);
  if (result != VK_SUCCESS) return vulkanError(result, "creating a command pool");

  if (auto opened = openPipelineCache(context); !opened) return opened.error();

  const VkFenceCreateInfo fence_info{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  result = vkCreateFence(context.device, &fence_info, nullptr, &context.fence);
  if (result != VK_SUCCESS) return vulkanError(result, "creating a fence");
  return {};
}

}  // namespace

Context::~Context() {
  if (!device) return;
  vkDeviceWaitIdle(device);
  savePipelineCache(*this);
  staging.reset();
  kernels.clear();
  vkDestroyFence(device, fence, nullptr);
  vkDestroyPipelineCache(device, pipeline_cache, nullptr);
  vkDestroyCommandPool(device, command_pool, nullptr);
  vkDestroyDevice(device, nullptr);
}

Result<void> Context::run(VkCommandBuffer commands) {
  VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  VkResult result = vkQueueSubmit(queue, 1, &submit, fence);
  if (result == VK_SUCCESS) {
    result = vkWaitForFences(device, 1, &fence, VK_TRUE, std::numeric_limits<uint64_t>::max());
    vkResetFences(device, 1, &fence);
  }
  if (result != VK_SUCCESS) return vulkanError(result, "running on " + physical.info.name);
  return {};
}

Result<Device> Device::create(const DeviceOptions& options) {
  auto context = std::make_unique<Context>();
  context->options = options;
  auto instance = Instance::create(options.validation);
  if (!instance) return instance.error();
  context->instance = std::move(*instance);
  auto candidates = findCandidates(context->instance->handle);
  if (!candidates) return candidates.error();
  auto chosen = chooseCandidate(*candidates, options.choice);
  if (!chosen) return chosen.error();
  context->physical = (*candidates)[*chosen];
  vkGetPhysicalDeviceMemoryProperties(context->physical.handle, &context->memory);
  if (auto created = createLogicalDevice(*context); !created) return created.error();
  return Device(std::move(context));
}

Device::Device(std::unique_ptr<Context> context) : context_(std::move(context)) {}
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;
Device::~Device() = default;

const DeviceInfo& Device::info() const { return context_->physical.info; }
uint64_t Device::maxBufferBytes() const { return context_->physical.properties.limits.maxStorageBufferRange; }
const std::map<std::string, KernelTime>& Device::kernelTimes() const { return context_->kernel_times; }
uint32_t Device::validationErrors() const { return context_->instance->log->count; }
std::vector<std::string> Device::validationMessages() const { return context_->instance->log->messages; }

}  // namespace comap::gpu
