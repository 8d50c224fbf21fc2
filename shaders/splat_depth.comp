// First pass of a prediction: the nearest depth of any disc, per pixel, as the bits of a float.
// Reads place and shape; writes depths by atomicMin. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2, r32ui) uniform uimageBuffer depths;
const int kVisibleBinding = 3;
#include "common/visible_read.glsl"
#include "common/frame.glsl"
struct Push {
  FRAME_FIELDS
  float min_confidence;
  float max_depth;
  uint both_sides;
  uint base;    // of the chunk's rows
  uint count;   // rows of the chunk
  uint clears;  // of resolve
};
#include "common/push.glsl"
#include "common/disc.glsl"

bool improves(Disc disc, ivec2 pixel) {
  vec2 at = hit(disc, rayOf(vec2(pixel)));
  return at.y <= 1.0 && at.x > 0.0 && fetchWord(depths, pixel.y * int(push.width) + pixel.x) > floatBitsToUint(at.x);
}

void improve(Disc disc, ivec2 pixel) {
  float depth = hit(disc, rayOf(vec2(pixel))).x;
  imageAtomicMin(depths, pixel.y * int(push.width) + pixel.x, floatBitsToUint(depth));
}
#include "common/footprint.glsl"

void visit(uint item) {
  uint i = visibleSurfel(item);
  improveFootprint(discOf(fetch(places, i), fetch(shapes, i)));
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
