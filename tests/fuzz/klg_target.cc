// A log of Logger2, pictures of 32x24 pixels.
#include "edge_agent/capture/klg_source.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  CameraConfig camera;
  camera.rig.colour.pinhole = {30, 30, 15.5, 11.5, 32, 24};
  const fuzz::MemoryFile file(bytes);
  auto source = openKlg(file.path(), {}, camera);
  if (!source) return;
  for (int i = 0; i < 8; ++i)
    if (const auto frame = (*source)->next(); frame && !*frame) return;
}
