// Between two groups of chunks of a prediction: what is shown stays shown, unless the next group has a surfel whose
// centre is nearer; which surfel it is is forgotten, for numbers are the group's own.
// Changes keys. One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/items.glsl"
#include "common/texels.glsl"
#include "common/surfel.glsl"
layout(local_size_x = 128) in;
layout(binding = 0, r32ui) uniform uimageBuffer keys;
struct Push {
  uint count;  // pixels
};
#include "common/push.glsl"

void visit(uint i) {
  uint key = fetchWord(keys, i);
  // One less than the least key of this rank, which is from 1 on. No surfel has the number that this leaves: neither
  // has what an earlier group left, nor what is empty.
  bool shown = (key & kSurfelMask) != kSurfelMask;
  if (shown) imageStore(keys, int(i), uvec4((key >> kRankShift << kRankShift) - 1u));
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.count, visit)
}
