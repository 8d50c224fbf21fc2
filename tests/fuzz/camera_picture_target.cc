// A buffer that a camera driver filled: format, width / 2, height / 2 and stride in the first six bytes.
#include "edge_agent/capture/picture_convert.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  if (bytes.size() < 6) return;
  Picture picture;
  picture.format = static_cast<PixelFormat>(bytes[0] % 8);
  picture.full_range = bytes[0] >= 128;
  picture.width = bytes[1] * 2 + bytes[5] % 2;
  picture.height = bytes[2] * 2 + bytes[5] / 2 % 2;
  picture.stride_bytes = static_cast<int16_t>(bytes[3] | bytes[4] << 8);
  picture.bytes.assign(bytes.begin() + 6, bytes.end());
  (void)bool(toColour(picture));
  (void)bool(toDepthValues(picture));
}
