#include "mapping_core/gpu/recorder.h"

#include <array>
#include <cassert>
#include <optional>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

constexpr uint32_t kMostBindings = 9;

}  // namespace

struct Recorder::State {
  Context* context = nullptr;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  VkDescriptorPool descriptors = VK_NULL_HANDLE;
  VkQueryPool queries = VK_NULL_HANDLE;
  std::optional<Error> failure;  // of what was recorded first
  uint32_t most_dispatches = 0;
  std::vector<std::string> dispatched;

  ~State() {
    if (queries) vkDestroyQueryPool(context->device, queries, nullptr);
    if (descriptors) vkDestroyDescriptorPool(context->device, descriptors, nullptr);
    if (commands) vkFreeCommandBuffers(context->device, context->command_pool, 1, &commands);
  }

  void addTimes() const;

  void barrier() {
    VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    memory.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    memory.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                           VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_HOST_READ_BIT | VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
    constexpr VkPipelineStageFlags kWork = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    vkCmdPipelineBarrier(commands, kWork, kWork | VK_PIPELINE_STAGE_HOST_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT, 0,
                         1, &memory, 0, nullptr, 0, nullptr);
  }
};

Result<Recorder> Recorder::begin(Context& context, uint32_t most_dispatches) {
  auto state = std::make_unique<State>();
  state->context = &context;
  state->most_dispatches = most_dispatches;
  VkCommandBufferAllocateInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  info.commandPool = context.command_pool;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  VkResult result = vkAllocateCommandBuffers(context.device, &info, &state->commands);
  if (result != VK_SUCCESS) return vulkanError(result, "allocating a command buffer");

  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, most_dispatches * kMostBindings},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, most_dispatches * kMostBindings},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER, most_dispatches * kMostBindings}};
  VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
  pool_info.maxSets = most_dispatches;
  pool_info.poolSizeCount = 3;
  pool_info.pPoolSizes = sizes;
  result = vkCreateDescriptorPool(context.device, &pool_info, nullptr, &state->descriptors);
  if (result != VK_SUCCESS) return vulkanError(result, "creating a descriptor pool");

  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  result = vkBeginCommandBuffer(state->commands, &begin);
  if (result != VK_SUCCESS) return vulkanError(result, "recording");

  if (context.options.timestamps && context.physical.timestamp_bits > 0) {
    VkQueryPoolCreateInfo query_info{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    query_info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    query_info.queryCount = 2 * most_dispatches;
    result = vkCreateQueryPool(context.device, &query_info, nullptr, &state->queries);
    if (result != VK_SUCCESS) return vulkanError(result, "creating a query pool");
    vkCmdResetQueryPool(state->commands, state->queries, 0, 2 * most_dispatches);
  }
  return Recorder(std::move(state));
}

void Recorder::dispatch(const Kernel& kernel, std::initializer_list<const Buffer*> buffers, const void* push,
                        size_t push_bytes, uint32_t groups, const Buffer* indirect_groups) {
  assert(buffers.size() == kernel.bindings.size() && buffers.size() <= kMostBindings &&
         push_bytes == kernel.push_bytes);
  assert(state_->dispatched.size() < state_->most_dispatches);
  if (state_->failure) return;
  Context& context = *state_->context;
  VkDescriptorSetAllocateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
  info.descriptorPool = state_->descriptors;
  info.descriptorSetCount = 1;
  info.pSetLayouts = &kernel.set_layout;
  VkDescriptorSet set = VK_NULL_HANDLE;
  if (const VkResult result = vkAllocateDescriptorSets(context.device, &info, &set); result != VK_SUCCESS) {
    state_->failure = vulkanError(result, "recording");
    return;
  }

  std::array<VkDescriptorBufferInfo, kMostBindings> infos{};
  std::array<VkBufferView, kMostBindings> views{};
  std::array<VkWriteDescriptorSet, kMostBindings> writes{};
  uint32_t count = 0;
  for (const Buffer* buffer : buffers) {
    infos[count] = {buffer->state()->buffer, 0, VK_WHOLE_SIZE};
    auto& write = writes[count];
    write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = count;
    write.descriptorCount = 1;
    const BindingKind& kind = kernel.bindings[count];
    write.descriptorType = kind.type;
    write.pBufferInfo = &infos[count];
    if (kind.type != VK_DESCRIPTOR_TYPE_STORAGE_BUFFER) {
      const auto view = viewOf(*buffer->state(), kind.format);
      if (!view) {
        state_->failure = view.error();
        return;
      }
      views[count] = *view;
      write.pTexelBufferView = &views[count];
    }
    ++count;
  }
  vkUpdateDescriptorSets(context.device, count, writes.data(), 0, nullptr);

  const auto commands = state_->commands;
  const auto query = static_cast<uint32_t>(2 * state_->dispatched.size());
  if (state_->queries) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, state_->queries, query);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline);
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.layout, 0, 1, &set, 0, nullptr);
  if (push_bytes > 0) {
    vkCmdPushConstants(commands, kernel.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<uint32_t>(push_bytes),
                       push);
  }
  if (indirect_groups) {
    vkCmdDispatchIndirect(commands, indirect_groups->state()->buffer, 0);
  } else {
    vkCmdDispatch(commands, groups, 1, 1);
  }
  state_->barrier();
  if (state_->queries) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, state_->queries, query + 1);
  state_->dispatched.push_back(kernel.name);
}

void Recorder::fill(const Buffer& buffer, uint32_t word, size_t bytes) {
  assert(bytes % 4 == 0 && bytes <= buffer.bytes());
  if (bytes == 0) return;
  vkCmdFillBuffer(state_->commands, buffer.state()->buffer, 0, bytes, word);
  state_->barrier();
}

void Recorder::copy(const Buffer& from, const Buffer& to, size_t bytes, size_t to_offset) {
  assert(bytes <= from.bytes() && to_offset + bytes <= to.bytes());
  if (bytes == 0) return;
  const VkBufferCopy region{0, to_offset, bytes};
  vkCmdCopyBuffer(state_->commands, from.state()->buffer, to.state()->buffer, 1, &region);
  state_->barrier();
}

Result<void> Recorder::submit() {
  if (state_->failure) return *state_->failure;
  if (const VkResult result = vkEndCommandBuffer(state_->commands); result != VK_SUCCESS) {
    return vulkanError(result, "recording");
  }
  if (auto done = state_->context->run(state_->commands); !done) return done;
  state_->addTimes();
  return {};
}

void Recorder::State::addTimes() const {
  if (!queries || dispatched.empty()) return;
  std::vector<uint64_t> ticks(2 * dispatched.size());
  const VkResult result = vkGetQueryPoolResults(context->device, queries, 0, static_cast<uint32_t>(ticks.size()),
                                                ticks.size() * sizeof(uint64_t), ticks.data(), sizeof(uint64_t),
                                                VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
  if (result != VK_SUCCESS) return;  // times are a courtesy
  const double ms_per_tick = context->physical.properties.limits.timestampPeriod * 1e-6;
  const uint64_t valid = ~uint64_t{0} >> (64 - context->physical.timestamp_bits);  // above them they begin anew
  for (size_t i = 0; i < dispatched.size(); ++i) {
    auto& time = context->kernel_times[dispatched[i]];
    ++time.dispatches;
    time.ms += static_cast<double>((ticks[2 * i + 1] - ticks[2 * i]) & valid) * ms_per_tick;
  }
}

Recorder::Recorder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() = default;

}  // namespace comap::gpu
