// Counts the new surfels of each block of 1024 candidate pixels.
// Reads measurements and covered marks; writes one count per block. One workgroup = one block.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/scan.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer measurements;
layout(binding = 1, r32ui) uniform readonly uimageBuffer covered;
layout(std430, binding = 2) writeonly buffer Blocks { uint blocks[]; };
struct Push {
  FRAME_FIELDS
  uint candidates;
};
#include "common/push.glsl"
#include "common/measurement.glsl"
#include "common/insertion.glsl"

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint first = gl_WorkGroupID.x * kThreads * kFlagsPerThread + thread * kFlagsPerThread;
  uint flags = 0u;
  for (uint k = 0u; k < kFlagsPerThread; ++k) flags += startsSurfel(first + k) ? 1u : 0u;
  uint before = scanThreads(flags);
  if (thread == kThreads - 1u) blocks[gl_WorkGroupID.x] = before + flags;
}
