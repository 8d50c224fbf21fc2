#include "mapping_core/gpu/device.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>

#include "mapping_core/gpu/buffer.h"
#include "tests/mapping_core/gpu/test_device.h"

namespace comap {
namespace {

TEST(Device, ListsItsKindWithNameAndType) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto devices = gpu::listDevices();
  ASSERT_TRUE(devices) << devices.error().text;
  ASSERT_FALSE(devices->empty());
  for (size_t i = 0; i < devices->size(); ++i) {
    EXPECT_EQ((*devices)[i].index, i);
    EXPECT_FALSE((*devices)[i].name.empty());
    EXPECT_FALSE((*devices)[i].type.empty());
  }
  EXPECT_TRUE((*devices)[device.info().index].refusal.empty());
}

TEST(Device, TakesAnIndexFromTheList) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::DeviceOptions options;
  options.choice = std::to_string(device.info().index);
  const auto same = gpu::Device::create(options);
  ASSERT_TRUE(same) << same.error().text;
  EXPECT_EQ(same->info().name, device.info().name);
}

TEST(Device, RefusesAnIndexBeyondTheListAndSaysWhatThereIs) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::DeviceOptions options;
  options.choice = "4000000000";
  const auto none = gpu::Device::create(options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNoDevice);
  EXPECT_NE(none.error().text.find(device.info().name), std::string::npos) << none.error().text;
}

TEST(Device, RefusesAChoiceThatIsNone) {
  COMAP_DEVICE_OR_SKIP(device);
  for (const char* choice : {"", "gpu", "-1", "1x", "99999999999999999999"}) {
    gpu::DeviceOptions options;
    options.choice = choice;
    const auto none = gpu::Device::create(options);
    ASSERT_FALSE(none) << choice;
    EXPECT_EQ(none.error().code, ErrorCode::kWrongUse) << choice;
  }
}

class BufferTest : public testing::TestWithParam<bool> {};

TEST_P(BufferTest, GivesBackWhatWasWritten) {
  COMAP_DEVICE_OR_SKIP(shared);
  gpu::DeviceOptions options;
  options.choice = std::to_string(shared.info().index);
  options.validation = true;
  options.force_staging = GetParam();
  auto device = gpu::Device::create(options);
  ASSERT_TRUE(device) << device.error().text;
  auto buffer = gpu::Buffer::create(device->context(), 4000, "test");
  ASSERT_TRUE(buffer) << buffer.error().text;
  if (GetParam()) {
    EXPECT_EQ(buffer->mapped(), nullptr);
  }
  std::vector<uint32_t> values(1000);
  std::iota(values.begin(), values.end(), 7u);
  ASSERT_TRUE(buffer->write(std::span<const uint32_t>(values)));
  const std::vector<uint32_t> two = {1, 2};
  ASSERT_TRUE(buffer->write(std::span<const uint32_t>(two), 500));
  values[500] = 1;
  values[501] = 2;
  const auto back = buffer->read<uint32_t>(1000);
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(*back, values);
  const auto part = buffer->read<uint32_t>(3, 499);
  ASSERT_TRUE(part);
  EXPECT_EQ(*part, (std::vector<uint32_t>{506, 1, 2}));
  EXPECT_EQ(validationText(*device), "");
}
INSTANTIATE_TEST_SUITE_P(MappedAndStaged, BufferTest, testing::Bool());

TEST(Device, KeepsCompiledKernelsForTheNext) {
  COMAP_DEVICE_OR_SKIP(shared);
  const std::string folder = testing::TempDir() + "comap-kernels-" + std::to_string(::getpid());
  gpu::DeviceOptions options;
  options.choice = std::to_string(shared.info().index);
  options.validation = true;
  options.cache_directory = folder + "/below";
  const auto files = [&] {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(options.cache_directory))
      found.push_back(entry.path());
    return found;
  };
  ASSERT_TRUE(gpu::Device::create(options));
  ASSERT_EQ(files().size(), 1u);
  const auto path = files()[0];
  ASSERT_TRUE(gpu::Device::create(options));
  // Of another driver, cut off, or nonsense: passed over, and replaced.
  for (const char* content : {"", "nonsense", "................................................................"}) {
    std::ofstream(path, std::ios::binary) << content;
    auto device = gpu::Device::create(options);
    ASSERT_TRUE(device) << device.error().text;
    EXPECT_EQ(validationText(*device), "");
    { const auto gone = std::move(*device); }
    EXPECT_GE(std::filesystem::file_size(path), 32u);
    EXPECT_EQ(files().size(), 1u);
  }
  // One damaged byte, wherever it is, and bytes too many: a driver would take them for good.
  const auto content = [&] {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string whole = content();
  const auto replaced = [&](const std::string& damaged) {
    std::ofstream(path, std::ios::binary) << damaged;
    const bool made = bool(gpu::Device::create(options));  // gone again: it writes its kernels when it goes
    return made && content() != damaged;
  };
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    ASSERT_TRUE(replaced(damaged)) << "byte " << at;
  }
  EXPECT_TRUE(replaced(whole + "more"));
  EXPECT_EQ(content(), whole);
  options.cache_directory = "/proc/nowhere";
  EXPECT_TRUE(gpu::Device::create(options));
  std::filesystem::remove_all(folder);
}

TEST(Buffer, LargerThanTheDeviceAllowsIsRefusedByName) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto buffer = gpu::Buffer::create(device.context(), device.maxBufferBytes() + 1, "too large");
  ASSERT_FALSE(buffer);
  EXPECT_EQ(buffer.error().code, ErrorCode::kOutOfMemory);
  EXPECT_NE(buffer.error().text.find("too large"), std::string::npos);
}

}  // namespace
}  // namespace comap
