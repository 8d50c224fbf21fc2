// What is read from SPIR-V about a kernel's bindings. Whether it suits a device is checked by the validation layer in
// every test that runs kernels.
#include "mapping_core/gpu/kernel_bindings.h"

#include <gtest/gtest.h>

#include "shaders/associate.h"
#include "shaders/list_seen.h"
#include "shaders/scan_blocks.h"

namespace comap::gpu {
namespace {

TEST(KernelBindings, SaysWhatEachIs) {
  // As shaders/associate.comp declares them.
  const auto kinds = bindingKinds(kAssociateSpirv, 7);
  ASSERT_EQ(kinds.size(), 7u);
  for (const size_t i : {0, 1, 2}) {
    EXPECT_EQ(kinds[i].type, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER) << i;
    EXPECT_EQ(kinds[i].format, VK_FORMAT_R32G32B32A32_SFLOAT) << i;
  }
  EXPECT_EQ(kinds[3].type, VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER);
  EXPECT_EQ(kinds[3].format, VK_FORMAT_R32_SFLOAT);
  EXPECT_EQ(kinds[4].type, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  for (const size_t i : {5, 6}) {
    EXPECT_EQ(kinds[i].type, VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER) << i;
    EXPECT_EQ(kinds[i].format, VK_FORMAT_R32_UINT) << i;
  }
  EXPECT_EQ(bindingKinds(kListSeenSpirv, 4)[3].format, VK_FORMAT_R32G32B32A32_UINT);
}

TEST(KernelBindings, StorageBuffersAndDamagedCodeAreStorage) {
  for (const auto& kind : bindingKinds(kScanBlocksSpirv, 2)) EXPECT_EQ(kind.type, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  std::vector<uint32_t> code(std::begin(kAssociateSpirv), std::end(kAssociateSpirv));
  code[5] = 0;  // an instruction of no words
  for (const auto& kind : bindingKinds(code, 7)) EXPECT_EQ(kind.type, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  EXPECT_EQ(bindingKinds({}, 1).size(), 1u);
}

}  // namespace
}  // namespace comap::gpu
