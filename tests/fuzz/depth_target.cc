// Packed depth; the first two bytes are the size that the message would tell.
#include "protocol/codec/depth_codec.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  if (bytes.size() < 2) return;
  const auto depth = decodeDepth(bytes.subspan(2), bytes[0] * 4, bytes[1] * 4);
  if (!depth) return;
  const auto encoded = encodeDepth(*depth);
  fuzz::require(bool(encoded), "what was decoded can be encoded");
  const auto again = decodeDepth(*encoded, depth->width(), depth->height());
  fuzz::require(again && std::equal(again->data(), again->data() + again->size(), depth->data()), "depth is lossless");
}
