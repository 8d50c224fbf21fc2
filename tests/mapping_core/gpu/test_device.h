// The device that tests run on: validated, chosen by COMAP_TEST_DEVICE (default auto). A test fails if the validation
// layer says anything of it while the test runs.
#pragma once

#include "mapping_core/gpu/device.h"

namespace comap {

/// One per process; nullptr where the machine has no Vulkan device, with the reason in `reason`.
gpu::Device* testDevice();
const std::string& testDeviceProblem();

/// Validation messages so far in one text; empty if there are none. For devices of a test's own.
std::string validationText(const gpu::Device& device);

}  // namespace comap

/// Leaves the test with a reason if there is no device, else defines `device`.
#define COMAP_DEVICE_OR_SKIP(device)                                                            \
  if (!comap::testDevice()) GTEST_SKIP() << "no Vulkan device: " << comap::testDeviceProblem(); \
  [[maybe_unused]] comap::gpu::Device& device = *comap::testDevice()
