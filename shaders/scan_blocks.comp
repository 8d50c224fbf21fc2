// Turns the counts of blocks into exclusive prefix sums in place and writes their total. One workgroup in all.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/scan.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) buffer Blocks { uint blocks[]; };
layout(std430, binding = 1) writeonly buffer Counters { uint counters[]; };
struct Push {
  uint count;
  uint total_slot;  // of counters
};
#include "common/push.glsl"

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint per_thread = (push.count + kThreads - 1u) / kThreads;
  uint first = min(thread * per_thread, push.count);
  uint end = min(first + per_thread, push.count);
  uint sum = 0u;
  for (uint i = first; i < end; ++i) sum += blocks[i];
  uint running = scanThreads(sum);
  for (uint i = first; i < end; ++i) {
    uint own = blocks[i];
    blocks[i] = running;
    running += own;
  }
  if (thread == kThreads - 1u) counters[push.total_slot] = running;
}
