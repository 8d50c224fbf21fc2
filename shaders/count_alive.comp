// Counts the surfels not removed in each block of 1024. Reads place; writes one count per block.
// One workgroup = one block.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/scan.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 1) writeonly buffer Blocks { uint blocks[]; };
struct Push {
  uint count;
};
#include "common/push.glsl"

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint first = gl_WorkGroupID.x * kThreads * kFlagsPerThread + thread * kFlagsPerThread;
  uint flags = 0u;
  for (uint i = first; i < min(first + kFlagsPerThread, push.count); ++i) flags += places[i].w >= 0.0 ? 1u : 0u;
  uint before = scanThreads(flags);
  if (thread == kThreads - 1u) blocks[gl_WorkGroupID.x] = before + flags;
}
