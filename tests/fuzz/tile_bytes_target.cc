// A stored tile's surfels; the first three bytes are how many the row tells.
#include "mapping_core/store/tile_bytes.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  if (bytes.size() < 3) return;
  const int64_t count = bytes[0] | bytes[1] << 8 | bytes[2] << 16;
  const auto surfels = decompressSurfels(bytes.subspan(3), count);
  if (!surfels) return;
  const auto again = decompressSurfels(compressSurfels(*surfels), count);
  fuzz::require(bool(again), "what was read can be written and read");
}
