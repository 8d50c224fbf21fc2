#include "tests/mapping_core/gpu/test_device.h"

#include <dlfcn.h>

#include <cstdlib>

namespace comap {
namespace {

Result<gpu::Device> make() {
  // The driver must not be unloaded before the leak checker looks for the owners of its memory.
  dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_NODELETE);
  gpu::DeviceOptions options;
  options.validation = true;
  if (const char* choice = std::getenv("COMAP_TEST_DEVICE")) options.choice = choice;
  return gpu::Device::create(options);
}

Result<gpu::Device>& made() {
  static Result<gpu::Device> device = make();
  return device;
}

}  // namespace

gpu::Device* testDevice() { return made() ? &*made() : nullptr; }

const std::string& testDeviceProblem() { return made().error().text; }

std::string validationText(const gpu::Device& device) {
  std::string text;
  for (const auto& message : device.validationMessages()) text += message + "\n";
  return text;
}

}  // namespace comap
