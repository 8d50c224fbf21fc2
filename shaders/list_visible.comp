// Lists the surfels whose centres lie before the camera and not far outside its image, so that the costlier kernels
// run for those only. The order of blocks in the list depends on scheduling; nothing that uses it depends on order.
// Reads place; writes the list. One workgroup = 1024 surfels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/frame.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
const int kVisibleBinding = 1;
#include "common/visible.glsl"
layout(push_constant) uniform Push {
  FRAME_FIELDS
  uint count;
  float min_confidence;
  float max_depth;
  float margin;  // pixels around the image
} push;

const float kNearest = 0.05;  // m
const uint kThreads = 128u;
const uint kSurfelsPerThread = 8u;
shared uint list_count;
shared uint list_base;

bool isVisible(uint i) {
  vec4 place = places[i];
  vec3 position = toCamera(place.xyz);
  vec2 at = project(position);
  vec2 size = vec2(push.width, push.height);
  return place.w >= push.min_confidence && position.z > kNearest && position.z < push.max_depth &&
         at.x > -push.margin && at.y > -push.margin && at.x < size.x + push.margin && at.y < size.y + push.margin;
}

void main() {
  uint thread = gl_LocalInvocationID.x;
  uint first = (gl_WorkGroupID.x * kThreads + thread) * kSurfelsPerThread;
  uint flags = 0u;
  for (uint k = 0u; k < kSurfelsPerThread; ++k) {
    flags |= first + k < push.count && isVisible(min(first + k, push.count - 1u)) ? 1u << k : 0u;
  }
  if (thread == 0u) list_count = 0u;
  barrier();
  uint slot = atomicAdd(list_count, uint(bitCount(flags)));
  barrier();
  if (thread == 0u) {
    list_base = atomicAdd(visible_header.w, list_count);
    atomicMax(visible_header.x, (list_base + list_count + 1023u) / 1024u);
    atomicMax(visible_header.y, 1u);
    atomicMax(visible_header.z, 1u);
  }
  barrier();
  slot += list_base;
  for (uint k = 0u; k < kSurfelsPerThread; ++k) {
    if ((flags >> k & 1u) != 0u) visible[slot++].x = first + k;
  }
}
