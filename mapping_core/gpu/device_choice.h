// Which Vulkan device is wanted, in words.
#pragma once

#include <string>

namespace comap::gpu {

/// Why these words choose no device, whatever devices there are; empty: they may.
std::string choiceProblem(const std::string& choice);

}  // namespace comap::gpu
