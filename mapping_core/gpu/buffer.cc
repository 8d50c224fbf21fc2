#include "mapping_core/gpu/buffer.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <optional>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;

std::optional<uint32_t> findMemoryType(const Context& context, uint32_t allowed, VkMemoryPropertyFlags flags) {
  for (uint32_t i = 0; i < context.memory.memoryTypeCount; ++i) {
    if ((allowed >> i & 1u) && (context.memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
  }
  return std::nullopt;
}

std::optional<uint32_t> chooseMemoryType(const Context& context, uint32_t allowed, MemoryUse use) {
  const VkMemoryPropertyFlags cached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  const VkMemoryPropertyFlags local = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  // Device memory is mapped only where reading it from the host is fast (unified memory, CPU devices).
  const auto preferences = use == MemoryUse::kDevice
                               ? std::vector<VkMemoryPropertyFlags>{kHost | cached | local, local, 0}
                               : std::vector<VkMemoryPropertyFlags>{kHost | cached, kHost};
  for (const auto flags : preferences) {
    if (const auto type = findMemoryType(context, allowed, flags)) return type;
  }
  return std::nullopt;
}

bool hostReadable(const Context& context, uint32_t type) {
  const auto flags = context.memory.memoryTypes[type].propertyFlags;
  return (flags & kHost) == kHost && (flags & VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
}

Result<void> transfer(Context& context, VkBuffer from, VkBuffer to, const VkBufferCopy& region) {
  VkCommandBufferAllocateInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  info.commandPool = context.command_pool;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  if (const VkResult result = vkAllocateCommandBuffers(context.device, &info, &commands); result != VK_SUCCESS) {
    return vulkanError(result, "allocating a command buffer");
  }
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  vkBeginCommandBuffer(commands, &begin);
  vkCmdCopyBuffer(commands, from, to, 1, &region);
  VkMemoryBarrier barrier{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT | VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT,
                       VK_PIPELINE_STAGE_HOST_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, 1, &barrier, 0, nullptr, 0,
                       nullptr);
  vkEndCommandBuffer(commands);
  auto done = context.run(commands);
  vkFreeCommandBuffers(context.device, context.command_pool, 1, &commands);
  return done;
}

}  // namespace

Result<std::unique_ptr<Buffer::State>> allocateBuffer(Context& context, size_t bytes, const char* name, MemoryUse use) {
  const std::string what = std::string("buffer '") + name + "' of " + std::to_string(bytes) + " bytes";
  auto state = std::make_unique<Buffer::State>();
  state->context = &context;
  state->name = name;
  state->bytes = bytes;
  VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  info.size = bytes;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
               VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT |
               VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  if (const VkResult result = vkCreateBuffer(context.device, &info, nullptr, &state->buffer); result != VK_SUCCESS) {
    return vulkanError(result, "creating " + what);
  }
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(context.device, state->buffer, &needs);
  const auto type = chooseMemoryType(context, needs.memoryTypeBits, use);
  if (!type) return Error{ErrorCode::kOutOfMemory, "Vulkan: no memory type for " + what};
  VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  allocation.allocationSize = needs.size;
  allocation.memoryTypeIndex = *type;
  if (const VkResult result = vkAllocateMemory(context.device, &allocation, nullptr, &state->memory);
      result != VK_SUCCESS) {
    return vulkanError(result, "allocating " + what);
  }
  if (const VkResult result = vkBindBufferMemory(context.device, state->buffer, state->memory, 0);
      result != VK_SUCCESS) {
    return vulkanError(result, "binding " + what);
  }
  if (use == MemoryUse::kStaging || (!context.options.force_staging && hostReadable(context, *type))) {
    if (const VkResult result = vkMapMemory(context.device, state->memory, 0, VK_WHOLE_SIZE, 0, &state->mapped);
        result != VK_SUCCESS) {
      return vulkanError(result, "mapping " + what);
    }
  }
  return state;
}

Buffer::State::~State() {
  for (const auto& [format, view] : views) vkDestroyBufferView(context->device, view, nullptr);
  if (buffer) vkDestroyBuffer(context->device, buffer, nullptr);
  if (memory) vkFreeMemory(context->device, memory, nullptr);
}

Result<VkBufferView> viewOf(Buffer::State& buffer, VkFormat format) {
  if (const auto found = buffer.views.find(format); found != buffer.views.end()) return found->second;
  const bool four = format == VK_FORMAT_R32G32B32A32_SFLOAT || format == VK_FORMAT_R32G32B32A32_UINT;
  const size_t texels = buffer.bytes / (four ? 16 : 4);
  const auto& properties = buffer.context->physical.properties;
  if (texels > properties.limits.maxTexelBufferElements) {
    return Error{ErrorCode::kOutOfMemory, "buffer '" + buffer.name + "' has " + std::to_string(texels) +
                                              " texels, device " + buffer.context->physical.info.name +
                                              " allows at most " +
                                              std::to_string(properties.limits.maxTexelBufferElements)};
  }
  VkBufferViewCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
  info.buffer = buffer.buffer;
  info.format = format;
  info.range = VK_WHOLE_SIZE;
  VkBufferView view = VK_NULL_HANDLE;
  if (const VkResult result = vkCreateBufferView(buffer.context->device, &info, nullptr, &view); result != VK_SUCCESS) {
    return vulkanError(result, "viewing buffer '" + buffer.name + "'");
  }
  buffer.views[format] = view;
  return view;
}

Result<Buffer> Buffer::create(Context& context, size_t bytes, const char* name) {
  const uint64_t most = context.physical.properties.limits.maxStorageBufferRange;
  if (bytes > most) {
    return Error{ErrorCode::kOutOfMemory, std::string("buffer '") + name + "' needs " + std::to_string(bytes) +
                                              " bytes, device " + context.physical.info.name + " allows at most " +
                                              std::to_string(most)};
  }
  auto state = allocateBuffer(context, std::max<size_t>(bytes, 16), name, MemoryUse::kDevice);
  if (!state) return state.error();
  return Buffer(std::move(*state));
}

namespace {

Result<Buffer::State*> stagingOf(Context& context, size_t bytes) {
  if (!context.staging || context.staging->bytes < bytes) {
    auto made = allocateBuffer(context, bytes, "staging", MemoryUse::kStaging);
    if (!made) return made.error();
    context.staging = std::move(*made);
  }
  return context.staging.get();
}

}  // namespace

Result<void> Buffer::write(const void* data, size_t bytes, size_t offset) {
  assert(state_ && offset + bytes <= state_->bytes);
  if (bytes == 0) return {};
  if (state_->mapped) {
    std::memcpy(static_cast<std::byte*>(state_->mapped) + offset, data, bytes);
    return {};
  }
  auto staging = stagingOf(*state_->context, bytes);
  if (!staging) return staging.error();
  std::memcpy((*staging)->mapped, data, bytes);
  return transfer(*state_->context, (*staging)->buffer, state_->buffer, {0, offset, bytes});
}

Result<void> Buffer::read(void* data, size_t bytes, size_t offset) const {
  assert(state_ && offset + bytes <= state_->bytes);
  if (bytes == 0) return {};
  if (state_->mapped) {
    std::memcpy(data, static_cast<const std::byte*>(state_->mapped) + offset, bytes);
    return {};
  }
  auto staging = stagingOf(*state_->context, bytes);
  if (!staging) return staging.error();
  auto done = transfer(*state_->context, state_->buffer, (*staging)->buffer, {offset, 0, bytes});
  if (done) std::memcpy(data, (*staging)->mapped, bytes);
  return done;
}

Buffer::Buffer() = default;
Buffer::Buffer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;
Buffer::~Buffer() = default;

size_t Buffer::bytes() const { return state_ ? state_->bytes : 0; }
void* Buffer::mapped() const { return state_ ? state_->mapped : nullptr; }

}  // namespace comap::gpu
