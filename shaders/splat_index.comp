// Second pass of a prediction: among the discs of the front surface the one whose centre is nearest to the pixel's
// ray, ties to the oldest. Choosing by depth instead would show the noise's side towards the camera.
// Reads place, shape and the first pass's depths; writes keys (relative distance << 23 | surfel) by atomicMin.
// One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 2) readonly buffer Depths { uint depths[]; };
layout(std430, binding = 3) buffer Keys { uint keys[]; };
const int kVisibleBinding = 4;
#include "common/visible.glsl"
#include "common/frame.glsl"
#include "common/surfel.glsl"
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
      float front = uintBitsToFloat(depths[pixel]);
      uint key = uint(clamp(at.y, 0.0, 1.0) * 510.0) << kRankShift | (push.base + i);
      if (at.y <= 1.0 && at.x > 0.0 && at.x <= front + gateOf(front) && keys[pixel] > key) atomicMin(keys[pixel], key);
    }
  }
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
