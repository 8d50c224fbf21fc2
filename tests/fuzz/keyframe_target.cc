// A keyframe in all the ways it is read and written anew.
#include "protocol/codec/keyframe_codec.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  const auto head = decodeKeyframeId(bytes);
  const auto bare = decodeKeyframeWithoutImages(bytes);
  const auto whole = decodeKeyframe(bytes);
  fuzz::require(head || !whole, "a keyframe that can be read has a head that can be read");
  fuzz::require(bare || !whole, "a keyframe that can be read can be read without its images");
  if (bare) {
    KeyframeLink link;
    link.linked = bare->id.sequence > 0;
    link.linked_to = link.linked ? bare->id.sequence - 1 : 0;
    const auto relinked = relinkKeyframe(bytes, link, 0);
    if (relinked) fuzz::require(bool(decodeKeyframeWithoutImages(*relinked)), "a relinked keyframe can be read");
  }
  if (!whole) return;
  fuzz::require(head->id == whole->id && bare->id == whole->id, "all ways of reading give one id");
  const auto thinned = thinColour(bytes, 30);
  if (thinned) fuzz::require(bool(decodeKeyframe(*thinned)), "a thinned keyframe can be read");
  const auto encoded = encodeKeyframe(*whole);
  if (encoded) fuzz::require(bool(decodeKeyframe(*encoded)), "what was encoded can be decoded");
}
