// Gives the surfels that were just inserted their first times. Reads the number inserted; writes times of one chunk.
// One item = one surfel that may have been inserted.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/items.glsl"
#include "common/times.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Counters { uint counters[]; };
layout(std430, binding = 1) writeonly buffer Times { uvec4 times[]; };
struct Push {
  uint candidates;
  uint slot;      // of counters: how many were inserted
  uint start;     // row of the first; below 0 (wrapped) where the first went into the chunk before
  uint capacity;  // rows of the chunk
  uint camera;
  uint tick;
};
#include "common/push.glsl"

void visit(uint i) {
  uint row = push.start + i;
  if (i < counters[push.slot] && row < push.capacity) times[row] = withTick(uvec4(0u), push.camera, push.tick);
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.candidates, visit)
}
