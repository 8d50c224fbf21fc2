#include "fleet_tools/command_line/fail.h"

#include <cstdio>

#include "mapping_core/store/store_remedy.h"

namespace comap {

int failWith(const Error& error) {
  std::fprintf(stderr, "fleet: %s\n", error.text.c_str());
  return exitCodeOf(error.code);
}

int failWithStore(const Error& error, const std::string& store) { return failWith(withRemedy(error, store)); }

}  // namespace comap
