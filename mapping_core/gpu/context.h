// The Vulkan objects behind a Device. For this folder's sources only.
#pragma once

#include <vulkan/vulkan.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mapping_core/gpu/buffer.h"
#include "mapping_core/gpu/device.h"
#include "mapping_core/gpu/kernel.h"
#include "mapping_core/gpu/kernel_bindings.h"

namespace comap::gpu {

struct ValidationLog {
  uint32_t count = 0;
  std::vector<std::string> messages;
};

/// A VkInstance with its debug messenger.
struct Instance {
  VkInstance handle = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
  std::unique_ptr<ValidationLog> log = std::make_unique<ValidationLog>();

  Instance() = default;
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance();
  static Result<std::unique_ptr<Instance>> create(bool validation);
};

struct Candidate {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties{};
  uint32_t queue_family = 0;
  uint32_t timestamp_bits = 0;  // of that queue family's timestamps; 0: it has none
  DeviceInfo info;
};
Result<std::vector<Candidate>> findCandidates(VkInstance instance);
/// Why a device cannot be used, to follow "it"; empty if it can.
std::string refusalOf(const VkPhysicalDeviceProperties& properties, bool has_compute_queue);
/// Index into `candidates`.
Result<size_t> chooseCandidate(const std::vector<Candidate>& candidates, const std::string& choice);

struct Kernel {
  VkDevice device = VK_NULL_HANDLE;
  std::string name;
  std::vector<BindingKind> bindings;
  uint32_t push_bytes = 0;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;

  Kernel() = default;
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;
  ~Kernel();
};

struct Buffer::State {
  Context* context = nullptr;
  std::string name;
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  size_t bytes = 0;
  void* mapped = nullptr;
  std::map<VkFormat, VkBufferView> views;  // made when a kernel first fetches from it

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State();
};

struct Context {
  std::unique_ptr<Instance> instance;
  Candidate physical;
  DeviceOptions options;
  VkPhysicalDeviceMemoryProperties memory{};
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  VkCommandPool command_pool = VK_NULL_HANDLE;
  VkPipelineCache pipeline_cache = VK_NULL_HANDLE;
  size_t cached_bytes = 0;  // of the pipeline cache, as read from disk
  VkFence fence = VK_NULL_HANDLE;
  std::map<std::string, std::unique_ptr<Kernel>> kernels;
  std::map<std::string, KernelTime> kernel_times;
  std::unique_ptr<Buffer::State> staging;  // grows to the largest transfer

  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context();

  /// Submits one command buffer and waits for it.
  Result<void> run(VkCommandBuffer commands);
};

/// The buffer as texels of `format`. kOutOfMemory also if it has more than the device can address.
Result<VkBufferView> viewOf(Buffer::State& buffer, VkFormat format);

enum class MemoryUse { kDevice, kStaging };
Result<std::unique_ptr<Buffer::State>> allocateBuffer(Context& context, size_t bytes, const char* name, MemoryUse use);

/// An Error for a failed Vulkan call.
Error vulkanError(VkResult result, const std::string& what);

}  // namespace comap::gpu
