// The Vulkan device that kernels run on: any GPU, or Mesa's llvmpipe on the CPU. No Vulkan type shows here.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap::gpu {

struct DeviceOptions {
  /// "auto" (discrete before integrated before virtual before CPU), "llvmpipe", or an index of listDevices().
  std::string choice = "auto";
  /// Run with VK_LAYER_KHRONOS_validation, which must be installed; see Device::validationErrors().
  bool validation = false;
  /// Never map device memory, always copy through staging buffers as a discrete GPU would; for tests.
  bool force_staging = false;
  /// Measure the time of each dispatch; see Device::kernelTimes().
  bool timestamps = false;
  /// Folder that keeps compiled kernels for the next start, one file per device and driver; empty: none is kept. What
  /// is there but of another device or driver, damaged or not writable is passed over: it only costs time.
  std::string cache_directory;
};

struct DeviceInfo {
  uint32_t index = 0;
  std::string name;     ///< as the driver calls it
  std::string type;     ///< "discrete", "integrated", "virtual", "cpu" or "other"
  std::string refusal;  ///< why it cannot be used; empty if it can
};

/// All devices Vulkan knows, usable or not, in Vulkan's order. kNoDevice without a Vulkan loader or driver.
Result<std::vector<DeviceInfo>> listDevices();

/// What one kernel has cost so far.
struct KernelTime {
  uint32_t dispatches = 0;
  double ms = 0;  ///< sum
};

/// Where compiled kernels are kept unless told otherwise: $XDG_CACHE_HOME/comap or ~/.cache/comap; empty without both.
std::string defaultCacheDirectory();

struct Context;

/// Thread rule: one thread at a time. Everything made on a device must be destroyed before it.
class Device {
 public:
  /// kNoDevice with the reasons of every device refused; kWrongUse for a choice that is none.
  static Result<Device> create(const DeviceOptions& options = {});
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;
  ~Device();

  const DeviceInfo& info() const;
  /// Bytes that one storage buffer may have.
  uint64_t maxBufferBytes() const;
  /// Errors and warnings the validation layer has reported since creation.
  uint32_t validationErrors() const;
  /// The texts of the first few of them.
  std::vector<std::string> validationMessages() const;

  /// By kernel name, since creation; empty without DeviceOptions::timestamps, and on devices that have none.
  const std::map<std::string, KernelTime>& kernelTimes() const;

  /// What buffers, kernels and recorders are made with; stays valid when the Device is moved.
  Context& context() const { return *context_; }

 private:
  explicit Device(std::unique_ptr<Context> context);
  std::unique_ptr<Context> context_;
};

}  // namespace comap::gpu
