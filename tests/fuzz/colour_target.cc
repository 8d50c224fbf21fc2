// A message's JPEG; the first two bytes are the size that the message would tell.
#include "protocol/codec/colour_codec.h"
#include "tests/fuzz/fuzz.h"

COMAP_FUZZ_TARGET(bytes) {
  if (bytes.size() < 2) return;
  const auto colour = comap::decodeColour(bytes.subspan(2), bytes[0] * 4, bytes[1] * 4);
  if (colour) comap::fuzz::require(bool(comap::encodeColour(*colour)), "what was decoded can be encoded");
}
