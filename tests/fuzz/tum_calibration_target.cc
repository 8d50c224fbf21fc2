#include "edge_agent/capture/tum_index.h"
#include "tests/fuzz/fuzz.h"

COMAP_FUZZ_TARGET(bytes) {
  const comap::fuzz::MemoryFile file(bytes);
  (void)bool(comap::readTumCalibration(file.path()));
}
