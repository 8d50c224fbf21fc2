// Removes surfels that never became stable and that no camera has updated for a while.
// Reads times; updates places and the chunk's number of removed ones. One item = one surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/items.glsl"
#include "common/surfel.glsl"
#include "common/times.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Times { uvec4 times[]; };
layout(std430, binding = 2) buffer Counters { uint counters[]; };  // a chunk: updated, removed
struct Push {
  uint count;
  uint chunk;
  uint tick;
  uint timeout;
  float stable_confidence;
};
#include "common/push.glsl"

void visit(uint i) {
  float confidence = places[i].w;
  bool unstable = confidence >= 0.0 && confidence < push.stable_confidence;
  if (!unstable || latestTick(times[i]) + push.timeout >= push.tick) return;
  places[i].w = kRemoved;
  atomicAdd(counters[2u * push.chunk + 1u], 1u);
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.count, visit)
}
