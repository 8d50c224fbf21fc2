// First pass of a prediction: the nearest depth of any disc, per pixel, as the bits of a float.
// Reads place and shape; writes depths by atomicMin. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 2) buffer Depths { uint depths[]; };
const int kVisibleBinding = 3;
#include "common/visible.glsl"
#include "common/frame.glsl"
struct Push {
  FRAME_FIELDS
  float min_confidence;
  float max_depth;
  uint both_sides;
  uint base;   // of the chunk's rows
  uint count;  // rows of the chunk
};
#include "common/push.glsl"
#include "common/disc.glsl"

void visit(uint item) {
  uint i = visible[item].x;
  Disc disc = discOf(places[i], shapes[i]);
  int last = disc.visible ? disc.high.y : -1;
  for (int y = disc.low.y; y <= last; ++y) {
    for (int x = disc.low.x; x <= disc.high.x; ++x) {
      vec2 at = hit(disc, rayOf(vec2(x, y)));
      uint pixel = uint(y) * push.width + uint(x);
      uint depth = floatBitsToUint(at.x);
      if (at.y <= 1.0 && at.x > 0.0 && depths[pixel] > depth) atomicMin(depths[pixel], depth);
    }
  }
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
