#include "mapping_core/gpu/kernel.h"

#include <cassert>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

Result<void> createLayouts(Context& context, Kernel& kernel) {
  std::vector<VkDescriptorSetLayoutBinding> bindings(kernel.bindings.size());
  for (uint32_t i = 0; i < bindings.size(); ++i) {
    bindings[i] = {i, kernel.bindings[i].type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  }
  VkDescriptorSetLayoutCreateInfo set_info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
  set_info.bindingCount = static_cast<uint32_t>(bindings.size());
  set_info.pBindings = bindings.data();
  VkResult result = vkCreateDescriptorSetLayout(context.device, &set_info, nullptr, &kernel.set_layout);
  if (result != VK_SUCCESS) return vulkanError(result, "laying out kernel " + kernel.name);

  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, kernel.push_bytes};
  VkPipelineLayoutCreateInfo layout_info{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  layout_info.setLayoutCount = 1;
  layout_info.pSetLayouts = &kernel.set_layout;
  layout_info.pushConstantRangeCount = kernel.push_bytes > 0 ? 1 : 0;
  layout_info.pPushConstantRanges = &range;
  result = vkCreatePipelineLayout(context.device, &layout_info, nullptr, &kernel.layout);
  if (result != VK_SUCCESS) return vulkanError(result, "laying out kernel " + kernel.name);
  return {};
}

Result<void> createPipeline(Context& context, Kernel& kernel, std::span<const uint32_t> code) {
  VkShaderModuleCreateInfo module_info{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  module_info.codeSize = code.size_bytes();
  module_info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  VkResult result = vkCreateShaderModule(context.device, &module_info, nullptr, &module);
  if (result != VK_SUCCESS) return vulkanError(result, "loading kernel " + kernel.name);
  VkComputePipelineCreateInfo info{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
  info.stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module;
  info.stage.pName = "main";
  info.layout = kernel.layout;
  result = vkCreateComputePipelines(context.device, context.pipeline_cache, 1, &info, nullptr, &kernel.pipeline);
  vkDestroyShaderModule(context.device, module, nullptr);
  if (result != VK_SUCCESS) return vulkanError(result, "compiling kernel " + kernel.name);
  return {};
}

}  // namespace

Result<const Kernel*> findKernel(Context& context, const KernelSource& source) {
  assert(source.push_bytes <= 128 && source.push_bytes % 4 == 0);
  const auto found = context.kernels.find(source.name);
  if (found != context.kernels.end()) return found->second.get();
  auto kernel = std::make_unique<Kernel>();
  kernel->device = context.device;
  kernel->name = source.name;
  kernel->bindings = bindingKinds(source.code, source.bindings);
  kernel->push_bytes = source.push_bytes;
  if (auto done = createLayouts(context, *kernel); !done) return done.error();
  if (auto done = createPipeline(context, *kernel, source.code); !done) return done.error();
  return (context.kernels[source.name] = std::move(kernel)).get();
}

Kernel::~Kernel() {
  vkDestroyPipeline(device, pipeline, nullptr);
  vkDestroyPipelineLayout(device, layout, nullptr);
  vkDestroyDescriptorSetLayout(device, set_layout, nullptr);
}

}  // namespace comap::gpu
