#include "tests/mapping_core/gpu/test_device.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

namespace comap {
namespace {

// Absent until a test asks for it.
std::optional<Result<gpu::Device>>& shared() {
  static std::optional<Result<gpu::Device>> device;
  return device;
}

Result<gpu::Device>& made() {
  if (shared()) return *shared();
  // The driver must not be unloaded before the leak checker looks for the owners of its memory.
  dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_NODELETE);
  gpu::DeviceOptions options;
  options.validation = true;
  if (const char* choice = std::getenv("COMAP_TEST_DEVICE")) options.choice = choice;
  return shared().emplace(gpu::Device::create(options));
}

class ValidationListener : public testing::EmptyTestEventListener {
  void OnTestEnd(const testing::TestInfo&) override {
    if (!shared() || !*shared()) return;
    const gpu::Device& device = **shared();
    if (device.validationErrors() > told_) ADD_FAILURE() << "the validation layer says:\n" << validationText(device);
    told_ = device.validationErrors();
  }

  uint32_t told_ = 0;
};

// Before main: listeners must not be added while tests run. It belongs to the tests' framework then.
[[maybe_unused]] const auto* const listener = [] {
  auto* made_here = new ValidationListener;
  testing::UnitTest::GetInstance()->listeners().Append(made_here);
  return made_here;
}();

}  // namespace

gpu::Device* testDevice() { return made() ? &*made() : nullptr; }

const std::string& testDeviceProblem() { return made().error().text; }

std::string validationText(const gpu::Device& device) {
  std::string text;
  for (const auto& message : device.validationMessages()) text += message + "\n";
  return text;
}

}  // namespace comap
