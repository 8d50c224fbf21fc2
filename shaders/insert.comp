// Appends a surfel for each candidate pixel that starts one, in raster order.
// Reads measurements, colours, covered marks and scanned blocks; writes the streams of one chunk from `start` on.
// One workgroup = one block of 1024 candidates.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/scan.glsl"
#include "common/surfel.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer measurements;
layout(binding = 1, r32ui) uniform readonly uimageBuffer covered;
layout(std430, binding = 2) readonly buffer Blocks { uint blocks[]; };
layout(binding = 3, r32ui) uniform readonly uimageBuffer colours;
layout(std430, binding = 4) writeonly buffer Places { vec4 places[]; };
layout(std430, binding = 5) writeonly buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 6) writeonly buffer Looks { uvec4 looks[]; };
layout(std430, binding = 7) writeonly buffer Records { uvec2 records[]; };
struct Push {
  FRAME_FIELDS
  uint candidates;
  uint start;     // row of the first new surfel; below 0 (wrapped) where the first go into the chunk before
  uint capacity;  // rows of the chunk: what is beyond goes into the next
  uint owner;
  uint contributor;
};
#include "common/push.glsl"
#include "common/pixel.glsl"
#include "common/measurement.glsl"
#include "common/insertion.glsl"

void write(uint slot, uint index) {
  vec4 m = fetch(measurements, index);
  vec2 pixel = vec2(pixelOf(index));
  uint c = fetchWord(colours, index);
  vec3 colour = vec3(c & 0xffu, c >> 8 & 0xffu, c >> 16 & 0xffu) * 256.0;
  places[slot] = vec4(toMap(rayOf(pixel) * m.w), confidenceOf(framesOf(c)));
  shapes[slot] = vec4(rotateToMap(m.xyz), radiusOf(m.w, m.z));
  looks[slot] = packLook(colour, 1u, push.owner, push.contributor);
  records[slot] = uvec2(floatBitsToUint(precisionOf(pixel, m.w, framesOf(c))), 0u);
}

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint first = gl_WorkGroupID.x * kThreads * kFlagsPerThread + thread * kFlagsPerThread;
  uint flags = 0u;
  for (uint k = 0u; k < kFlagsPerThread; ++k) flags |= startsSurfel(first + k) ? 1u << k : 0u;
  uint slot = push.start + blocks[gl_WorkGroupID.x] + scanThreads(uint(bitCount(flags)));
  for (uint k = 0u; k < kFlagsPerThread; ++k) {
    if ((flags >> k & 1u) == 0u) continue;
    if (slot < push.capacity) write(slot, candidatePixel(first + k));
    ++slot;
  }
}
