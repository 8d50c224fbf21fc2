#include "mapping_core/gpu/device_choice.h"

#include <charconv>
#include <cstdint>

namespace comap::gpu {

std::string choiceProblem(const std::string& choice) {
  if (choice == "auto" || choice == "llvmpipe") return "";
  uint32_t index = 0;
  const char* end = choice.data() + choice.size();
  const auto [at, code] = std::from_chars(choice.data(), end, index);
  if (code == std::errc() && at == end) return "";
  return "is '" + choice +
         "', expected auto, llvmpipe or a number from the list of devices (mapping_core --list-devices)";
}

}  // namespace comap::gpu
