// A picture on disk: read as colour (PNG or JPEG) and as depth (PNG).
#include "edge_agent/capture/image_file.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  const fuzz::MemoryFile file(bytes);
  (void)bool(readColour(file.path()));
  (void)bool(readDepth16(file.path()));
}
