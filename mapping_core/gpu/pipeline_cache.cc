#include "mapping_core/gpu/pipeline_cache.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>

#include "protocol/types/fnv1a.h"

namespace comap::gpu {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostBytes = uintmax_t{64} << 20;

// Before what the driver gave: drivers take whatever follows their own header for good.
struct Seal {
  char mark[8] = {'c', 'o', 'm', 'a', 'p', 'k', 'c', '1'};
  uint64_t bytes = 0;
  uint64_t checksum = 0;
};

Seal sealOf(std::span<const char> data) {
  Seal seal;
  seal.bytes = data.size();
  Fnv1a hash;
  hash.addAll(data);
  seal.checksum = hash.value();
  return seal;
}

// What is under a seal that holds; else why there is none.
Result<std::vector<char>> unseal(const std::vector<char>& file) {
  Seal seal;
  if (file.size() < sizeof(seal)) return Error{ErrorCode::kBadData, "is cut off"};
  std::memcpy(&seal, file.data(), sizeof(seal));
  std::vector<char> data(file.begin() + sizeof(seal), file.end());
  const Seal expected = sealOf(data);
  if (std::memcmp(&seal.mark, &expected.mark, sizeof(seal.mark)) != 0) {
    return Error{ErrorCode::kBadData, "was written by another program or version"};
  }
  if (seal.bytes != expected.bytes)
    return Error{ErrorCode::kBadData, seal.bytes > expected.bytes ? "is cut off" : "is longer than it says"};
  if (seal.checksum != expected.checksum) return Error{ErrorCode::kBadData, "does not match its checksum"};
  return data;
}

// By the header that all drivers write: its vendor, device and cache UUID are in the name and compared with the
// content.
fs::path pathOf(const Context& context) {
  const auto& properties = context.physical.properties;
  constexpr char kHex[] = "0123456789abcdef";
  std::string uuid;
  for (const uint8_t byte : properties.pipelineCacheUUID) {
    uuid += kHex[byte >> 4];
    uuid += kHex[byte & 15];
  }
  return fs::path(context.options.cache_directory) /
         ("kernels-" + std::to_string(properties.vendorID) + "-" + std::to_string(properties.deviceID) + "-" +
          std::to_string(properties.driverVersion) + "-" + uuid);
}

bool isOfDevice(const std::vector<char>& data, const VkPhysicalDeviceProperties& properties) {
  VkPipelineCacheHeaderVersionOne header;
  if (data.size() < sizeof(header)) return false;
  std::memcpy(&header, data.data(), sizeof(header));
  return header.headerSize >= sizeof(header) && header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE &&
         header.vendorID == properties.vendorID && header.deviceID == properties.deviceID &&
         std::memcmp(header.pipelineCacheUUID, properties.pipelineCacheUUID, VK_UUID_SIZE) == 0;
}

}  // namespace

std::string defaultCacheDirectory() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return (fs::path(cache) / "comap").string();
  if (const char* home = std::getenv("HOME"); home && *home) return (fs::path(home) / ".cache" / "comap").string();
  return {};
}

namespace {

// Empty if there is none, or none that can be used: that only costs time.
std::vector<char> readCache(const Context& context) {
  if (context.options.cache_directory.empty()) return {};
  std::error_code problem;
  const fs::path path = pathOf(context);
  const auto size = fs::file_size(path, problem);
  if (problem) {
    if (problem != std::errc::no_such_file_or_directory)
      spdlog::info("{} cannot be read ({}): kernels are compiled anew", path.string(), problem.message());
    return {};
  }
  Result<std::vector<char>> data =
      Error{ErrorCode::kBadData, "is larger than " + std::to_string(kMostBytes >> 20) + " MiB, which no cache is"};
  if (size <= kMostBytes) {
    std::ifstream stream(path, std::ios::binary);
    data = unseal({std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()});
  }
  if (data && !isOfDevice(*data, context.physical.properties)) {
    data = Error{ErrorCode::kBadData, "is of another device or driver"};
  }
  if (!data) {
    spdlog::info("{} {}: kernels are compiled anew", path.string(), data.error().text);
    return {};
  }
  return std::move(*data);
}

}  // namespace

Result<void> openPipelineCache(Context& context) {
  std::vector<char> data = readCache(context);
  VkPipelineCacheCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
  info.initialDataSize = data.size();
  info.pInitialData = data.empty() ? nullptr : data.data();
  VkResult result = vkCreatePipelineCache(context.device, &info, nullptr, &context.pipeline_cache);
  if (result != VK_SUCCESS && !data.empty()) {
    info.initialDataSize = 0;
    info.pInitialData = nullptr;
    result = vkCreatePipelineCache(context.device, &info, nullptr, &context.pipeline_cache);
    data.clear();
  }
  if (result != VK_SUCCESS) return vulkanError(result, "creating a pipeline cache");
  context.cached_bytes = data.size();
  return {};
}

void savePipelineCache(const Context& context) {
  if (context.options.cache_directory.empty() || !context.pipeline_cache) return;
  size_t size = 0;
  if (vkGetPipelineCacheData(context.device, context.pipeline_cache, &size, nullptr) != VK_SUCCESS) return;
  if (size == context.cached_bytes || size > kMostBytes) return;
  std::vector<char> data(size);
  if (vkGetPipelineCacheData(context.device, context.pipeline_cache, &size, data.data()) != VK_SUCCESS) return;
  // Whole or not at all, also when two processes end at once.
  std::error_code problem;
  fs::create_directories(context.options.cache_directory, problem);
  const fs::path path = pathOf(context), part = path.string() + "." + std::to_string(::getpid());
  std::ofstream file(part, std::ios::binary);
  data.resize(size);
  const Seal seal = sealOf(data);
  file.write(reinterpret_cast<const char*>(&seal), sizeof(seal));
  file.write(data.data(), static_cast<std::streamsize>(size));
  file.close();
  if (file) fs::rename(part, path, problem);
  if (!file || problem) fs::remove(part, problem);
}

}  // namespace comap::gpu
