#include "mapping_core/gpu/recorder.h"

#include <gtest/gtest.h>

#include <random>

#include "mapping_core/surfels/push_constants.h"
#include "mapping_core/surfels/surfel_kernels.h"
#include "tests/mapping_core/gpu/test_device.h"

namespace comap {
namespace {

TEST(Recorder, EachStepSeesTheOneBefore) {
  COMAP_DEVICE_OR_SKIP(device);
  auto from = gpu::Buffer::create(device.context(), 64, "from");
  auto to = gpu::Buffer::create(device.context(), 64, "to");
  ASSERT_TRUE(from && to);
  auto recorder = gpu::Recorder::begin(device.context());
  ASSERT_TRUE(recorder);
  recorder->fill(*from, 5, 64);
  recorder->copy(*from, *to, 64);
  recorder->fill(*from, 6, 32);
  recorder->copy(*from, *to, 16);
  ASSERT_TRUE(recorder->submit());
  const auto words = to->read<uint32_t>(16);
  ASSERT_TRUE(words);
  EXPECT_EQ((*words)[0], 6u);
  EXPECT_EQ((*words)[4], 5u);
}

// Exclusive prefix sums, for lengths around the scan's block sizes.
TEST(ScanBlocks, MatchesSequentialSums) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto kernels = SurfelKernels::create(device.context());
  ASSERT_TRUE(kernels) << kernels.error().text;
  std::mt19937 random(1);
  for (const uint32_t count : {1u, 127u, 128u, 129u, 1000u, 8193u}) {
    std::vector<uint32_t> values(count), expected(count);
    uint32_t sum = 0;
    for (uint32_t i = 0; i < count; ++i) {
      values[i] = static_cast<uint32_t>(random() % 1025);
      expected[i] = sum;
      sum += values[i];
    }
    auto blocks = gpu::Buffer::create(device.context(), count * 4, "blocks");
    auto counters = gpu::Buffer::create(device.context(), 16, "counters");
    ASSERT_TRUE(blocks && counters);
    ASSERT_TRUE(blocks->write(std::span<const uint32_t>(values)));
    auto recorder = gpu::Recorder::begin(device.context());
    ASSERT_TRUE(recorder);
    recorder->dispatch(*kernels->scan_blocks, {&*blocks, &*counters}, ScanBlocksPush{count, 1}, 1);
    ASSERT_TRUE(recorder->submit());
    const auto scanned = blocks->read<uint32_t>(count);
    const auto total = counters->read<uint32_t>(1, 1);
    ASSERT_TRUE(scanned && total);
    EXPECT_EQ(*scanned, expected) << count;
    EXPECT_EQ(total->front(), sum) << count;
  }
}

TEST(Device, MeasuresKernelsWhenAsked) {
  COMAP_DEVICE_OR_SKIP(shared);
  gpu::DeviceOptions options;
  options.choice = std::to_string(shared.info().index);
  options.timestamps = true;
  auto device = gpu::Device::create(options);
  ASSERT_TRUE(device);
  const auto kernels = SurfelKernels::create(device->context());
  auto blocks = gpu::Buffer::create(device->context(), 64, "blocks");
  auto counters = gpu::Buffer::create(device->context(), 16, "counters");
  ASSERT_TRUE(kernels && blocks && counters);
  for (int i = 0; i < 2; ++i) {
    auto recorder = gpu::Recorder::begin(device->context());
    ASSERT_TRUE(recorder);
    recorder->fill(*blocks, 0, 64);
    recorder->dispatch(*kernels->scan_blocks, {&*blocks, &*counters}, ScanBlocksPush{16, 0}, 1);
    ASSERT_TRUE(recorder->submit());
  }
  ASSERT_EQ(device->kernelTimes().count("scan_blocks"), 1u);
  EXPECT_EQ(device->kernelTimes().at("scan_blocks").dispatches, 2u);
  EXPECT_GT(device->kernelTimes().at("scan_blocks").ms, 0);
}

}  // namespace
}  // namespace comap
