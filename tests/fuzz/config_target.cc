// A configuration file of a robot or a core; COMAP_CONFIG says of which.
#include COMAP_CONFIG_HEADER
#include "tests/fuzz/fuzz.h"

#define COMAP_JOIN3(a, b, c) a##b##c
#define COMAP_JOIN(a, b, c) COMAP_JOIN3(a, b, c)

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  const fuzz::MemoryFile file(bytes);
  const auto config = COMAP_JOIN(read, COMAP_CONFIG, Config)(file.path());
  if (!config) return;
  const std::string printed = COMAP_JOIN(print, COMAP_CONFIG, Config)(*config);
  const fuzz::MemoryFile again({reinterpret_cast<const uint8_t*>(printed.data()), printed.size()});
  fuzz::require(bool(COMAP_JOIN(read, COMAP_CONFIG, Config)(again.path())), "what is printed can be read");
}
