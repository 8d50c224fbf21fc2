#include "mapping_core/gpu/kernel_bindings.h"

#include <map>

namespace comap::gpu {
namespace {

// Of SPIR-V: the opcodes, decoration and values that say what a binding is.
constexpr uint32_t kHeaderWords = 5;
constexpr uint32_t kTypeFloat = 22, kTypeImage = 25, kTypeSampledImage = 27, kTypePointer = 32, kVariable = 59,
                   kDecorate = 71;
constexpr uint32_t kDecorationBinding = 33, kDimBuffer = 5, kSampled = 1;

}  // namespace

std::vector<BindingKind> bindingKinds(std::span<const uint32_t> code, uint32_t bindings) {
  std::map<uint32_t, BindingKind> kinds;    // by type
  std::map<uint32_t, uint32_t> binding_of;  // by variable
  std::map<uint32_t, bool> is_float;
  std::vector<BindingKind> found(bindings);
  for (size_t at = kHeaderWords; at < code.size();) {
    const uint32_t words = code[at] >> 16, opcode = code[at] & 0xffff;
    if (words == 0 || at + words > code.size()) break;
    const auto operand = [&](uint32_t i) { return i < words ? code[at + i] : 0; };
    if (opcode == kDecorate && operand(2) == kDecorationBinding) binding_of[operand(1)] = operand(3);
    if (opcode == kTypeFloat) is_float[operand(1)] = true;
    if (opcode == kTypeImage && operand(3) == kDimBuffer) {
      const bool floats = is_float.contains(operand(2));
      kinds[operand(1)] = operand(7) == kSampled
                              ? BindingKind{VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
                                            floats ? VK_FORMAT_R32G32B32A32_SFLOAT : VK_FORMAT_R32G32B32A32_UINT}
                              : BindingKind{VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER,
                                            floats ? VK_FORMAT_R32_SFLOAT : VK_FORMAT_R32_UINT};
    }
    if (opcode == kTypeSampledImage && kinds.contains(operand(2))) kinds[operand(1)] = kinds[operand(2)];
    if (opcode == kTypePointer && kinds.contains(operand(3))) kinds[operand(1)] = kinds[operand(3)];
    if (opcode == kVariable && kinds.contains(operand(1))) {
      const auto binding = binding_of.find(operand(2));
      if (binding != binding_of.end() && binding->second < bindings) found[binding->second] = kinds[operand(1)];
    }
    at += words;
  }
  return found;
}

}  // namespace comap::gpu
