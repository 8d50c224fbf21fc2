#include "fleet_tools/command_line/fail.h"

#include <cstdio>

namespace comap {

int failWith(const Error& error) {
  std::fprintf(stderr, "fleet: %s\n", error.text.c_str());
  return exitCodeOf(error.code);
}

}  // namespace comap
