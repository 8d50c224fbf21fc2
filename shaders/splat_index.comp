// Second pass of a prediction: among the discs of the front surface the one whose centre is nearest to the pixel's
// ray, ties to the oldest. Choosing by depth instead would show the noise's side towards the camera.
// Reads place, shape and the first pass's depths; writes keys (rank << 23 | surfel) by atomicMin.
// One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2, r32ui) uniform readonly uimageBuffer depths;
layout(binding = 3, r32ui) uniform uimageBuffer keys;
const int kVisibleBinding = 4;
#include "common/visible_read.glsl"
#include "common/frame.glsl"
#include "common/surfel.glsl"
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

uint surfel;  // that is looked at, counted through the group's chunks

// The rank is the squared distance in 510 steps, counted from 1: see carry_ranks.comp.
uint keyOf(float apart) { return uint(clamp(apart, 0.0, 1.0) * 510.0) + 1u << kRankShift | surfel; }

bool improves(Disc disc, ivec2 pixel) {
  vec2 at = hit(disc, rayOf(vec2(pixel)));
  int index = pixel.y * int(push.width) + pixel.x;
  float front = uintBitsToFloat(fetchWord(depths, index));
  return at.y <= 1.0 && at.x > 0.0 && at.x <= front + gateOf(front) && fetchWord(keys, index) > keyOf(at.y);
}

void improve(Disc disc, ivec2 pixel) {
  float apart = hit(disc, rayOf(vec2(pixel))).y;
  imageAtomicMin(keys, pixel.y * int(push.width) + pixel.x, keyOf(apart));
}
#include "common/footprint.glsl"

void visit(uint item) {
  uint i = visibleSurfel(item);
  surfel = push.base + i;
  improveFootprint(discOf(fetch(places, i), fetch(shapes, i)));
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
