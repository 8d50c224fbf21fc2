// One message from the wire; COMAP_MESSAGE says which.
#include "protocol/codec/codec.h"
#include "tests/fuzz/fuzz.h"

#define COMAP_JOIN2(a, b) a##b
#define COMAP_JOIN(a, b) COMAP_JOIN2(a, b)

COMAP_FUZZ_TARGET(bytes) {
  const auto decoded = comap::COMAP_JOIN(decode, COMAP_MESSAGE)(bytes);
  if (!decoded) return;
  const auto encoded = comap::COMAP_JOIN(encode, COMAP_MESSAGE)(*decoded);
  if (!encoded) return;  // more may be read than is sent
  comap::fuzz::require(bool(comap::COMAP_JOIN(decode, COMAP_MESSAGE)(*encoded)), "what was encoded can be decoded");
}
