#include "fleet_tools/replay/frames_csv.h"
#include "tests/fuzz/fuzz.h"

COMAP_FUZZ_TARGET(bytes) {
  const comap::fuzz::MemoryFile file(bytes);
  (void)bool(comap::readRoundTimes(file.path()));
}
