// Copies one stream without the removed surfels, in the same order.
// Reads place and scanned blocks; `from` and `to` hold `pairs` pairs of words a surfel. One workgroup = one
// block of 1024.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/scan.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Blocks { uint blocks[]; };
layout(std430, binding = 2) readonly buffer From { uvec2 from[]; };
layout(std430, binding = 3) writeonly buffer To { uvec2 to[]; };
struct Push {
  uint count;
  uint pairs;  // of words a surfel
};
#include "common/push.glsl"

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint first = gl_WorkGroupID.x * kThreads * kFlagsPerThread + thread * kFlagsPerThread;
  uint flags = 0u;
  for (uint k = 0u; k < kFlagsPerThread; ++k) {
    flags |= first + k < push.count && places[min(first + k, push.count - 1u)].w >= 0.0 ? 1u << k : 0u;
  }
  uint slot = blocks[gl_WorkGroupID.x] + scanThreads(uint(bitCount(flags)));
  for (uint k = 0u; k < kFlagsPerThread; ++k) {
    if ((flags >> k & 1u) == 0u) continue;
    for (uint word = 0u; word < push.pairs; ++word)
      to[slot * push.pairs + word] = from[(first + k) * push.pairs + word];
    ++slot;
  }
}
