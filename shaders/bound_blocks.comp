// Boxes of blocks of 1024 rows. Reads place; writes two vec4 a block: its lowest and highest corner; of a block without
// surfels the lowest is above the highest. One workgroup = one block.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(std430, binding = 1) writeonly buffer Boxes { vec4 boxes[]; };
struct Push {
  uint first;  // block
  uint count;  // rows of the chunk
};
#include "common/push.glsl"

const uint kThreads = 128u;
const uint kRowsPerThread = 8u;
const uint kParts = 8u;
shared vec3 lows[kThreads];
shared vec3 highs[kThreads];

// Of the threads `first` to `first + count - 1`, into `first`.
void join(uint first, uint count, uint step) {
  vec3 low = lows[first];
  vec3 high = highs[first];
  for (uint k = 1u; k < count; ++k) {
    low = min(low, lows[first + k * step]);
    high = max(high, highs[first + k * step]);
  }
  lows[first] = low;
  highs[first] = high;
}

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint block = push.first + gl_WorkGroupID.x;
  vec3 low = vec3(1e30);
  vec3 high = vec3(-1e30);
  for (uint k = 0u; k < kRowsPerThread; ++k) {
    uint row = block * kThreads * kRowsPerThread + k * kThreads + thread;
    vec4 place = fetch(places, min(row, push.count - 1u));
    bool alive = row < push.count && place.w >= 0.0;
    low = alive ? min(low, place.xyz) : low;
    high = alive ? max(high, place.xyz) : high;
  }
  lows[thread] = low;
  highs[thread] = high;
  barrier();
  if (thread % (kThreads / kParts) == 0u) join(thread, kThreads / kParts, 1u);
  barrier();
  if (thread == 0u) {
    join(0u, kParts, kThreads / kParts);
    boxes[2u * block] = vec4(lows[0], 0.0);
    boxes[2u * block + 1u] = vec4(highs[0], 0.0);
  }
}
