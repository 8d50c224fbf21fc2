// Which device is taken, and why others are not: devices that this machine does not have.
#include <gtest/gtest.h>

#include "mapping_core/gpu/context.h"

namespace comap::gpu {
namespace {

// What Vulkan 1.1 promises of any device is less than what is needed; this is a usable one.
VkPhysicalDeviceProperties usable() {
  VkPhysicalDeviceProperties properties{};
  properties.apiVersion = VK_API_VERSION_1_1;
  properties.limits.maxPerStageDescriptorStorageBuffers = 8;
  properties.limits.maxComputeWorkGroupInvocations = 128;
  properties.limits.maxComputeSharedMemorySize = 16384;
  properties.limits.maxTexelBufferElements = 1u << 22;
  properties.limits.maxStorageBufferRange = 1u << 27;
  return properties;
}

Candidate candidate(uint32_t index, const std::string& name, VkPhysicalDeviceType type, const std::string& refusal) {
  Candidate made;
  made.properties = usable();
  made.properties.deviceType = type;
  made.info = {index, name, "", refusal};
  return made;
}

TEST(Candidate, EachLimitThatIsTooSmallIsNamedWithWhatIsNeeded) {
  EXPECT_EQ(refusalOf(usable(), true), "");
  EXPECT_EQ(refusalOf(usable(), false), "has no compute queue");
  VkPhysicalDeviceProperties old = usable();
  old.apiVersion = VK_API_VERSION_1_0;
  EXPECT_EQ(refusalOf(old, true), "supports Vulkan 1.0, needed 1.1");
  const auto refusalWith = [](auto change) {
    VkPhysicalDeviceProperties properties = usable();
    change(properties.limits);
    return refusalOf(properties, true);
  };
  EXPECT_EQ(refusalWith([](auto& limits) { limits.maxPerStageDescriptorStorageBuffers = 4; }),
            "maxPerStageDescriptorStorageBuffers is 4, needed 8");
  EXPECT_EQ(refusalWith([](auto& limits) { limits.maxComputeWorkGroupInvocations = 64; }),
            "maxComputeWorkGroupInvocations is 64, needed 128");
  EXPECT_EQ(refusalWith([](auto& limits) { limits.maxComputeSharedMemorySize = 8192; }),
            "maxComputeSharedMemorySize is 8192, needed 16384");
  EXPECT_EQ(refusalWith([](auto& limits) { limits.maxTexelBufferElements = 65536; }),
            "maxTexelBufferElements is 65536, needed 4194304");
  EXPECT_EQ(refusalWith([](auto& limits) { limits.maxStorageBufferRange = (1u << 27) - 1; }),
            "maxStorageBufferRange is 134217727, needed 134217728");
}

TEST(Candidate, AutoTakesTheFastestKindThatIsNotRefused) {
  const std::vector<Candidate> all = {candidate(0, "llvmpipe (LLVM 15)", VK_PHYSICAL_DEVICE_TYPE_CPU, ""),
                                      candidate(1, "chip", VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, ""),
                                      candidate(2, "card", VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, "is too old"),
                                      candidate(3, "other chip", VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, "")};
  EXPECT_EQ(chooseCandidate(all, "auto").value(), 1u);
  EXPECT_EQ(chooseCandidate(all, "llvmpipe").value(), 0u);
  EXPECT_EQ(chooseCandidate(all, "3").value(), 3u);
  const auto refused = chooseCandidate(all, "2");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kNoDevice);
  for (const char* part : {"'2'", "2: card", "refused, it is too old", "1: chip", "0: llvmpipe"})
    EXPECT_NE(refused.error().text.find(part), std::string::npos) << refused.error().text;
}

TEST(Candidate, NoDeviceAtAllIsSaid) {
  const auto none = chooseCandidate({}, "auto");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNoDevice);
}

}  // namespace
}  // namespace comap::gpu
