#include "fleet_tools/command_line/fail.h"

#include <cstdio>

namespace comap {

int failWith(const Error& error) {
  std::fprintf(stderr, "fleet: %s\n", error.text.c_str());
  return exitCodeOf(error.code);
}

int failWithStore(const Error& error, const std::string& store) {
  if (error.code != ErrorCode::kBadData) return failWith(error);
  return failWith({error.code, error.text + "; if it was a map store, 'fleet doctor " + store +
                                   "' tells what is damaged, and 'fleet recover " + store +
                                   " --out NEW' saves what is whole"});
}

}  // namespace comap
