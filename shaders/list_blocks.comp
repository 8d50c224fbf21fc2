// Lists the blocks of 1024 rows whose boxes the camera may see into, so that surfels of others are not looked at.
// Reads boxes; writes the list, its order depends on scheduling. One item = one block.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/items.glsl"
#include "common/texels.glsl"
#include "common/frame.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer boxes;
layout(std430, binding = 1) buffer Blocks {
  uvec4 block_header;  // workgroups (x, 1, 1), one for each block
  uint blocks[];
};
struct Push {
  FRAME_FIELDS
  uint count;  // blocks
  float max_depth;
  float margin;  // pixels around the image
};
#include "common/push.glsl"

const float kSlack = 0.1;  // m that surfels move by fusion until their box is made anew, and float rounding

// True if all of the box lies where dot(normal, x) + offset < 0, in the camera's frame.
bool isBeyond(vec3 centre, vec3 size, vec3 normal, float offset) {
  return dot(normal, centre) + dot(abs(rotateToMap(normal)), size) + offset < 0.0;
}

void visit(uint block) {
  vec3 low = fetch(boxes, 2u * block).xyz;
  vec3 high = fetch(boxes, 2u * block + 1u).xyz;
  vec3 centre = toCamera(0.5 * (low + high));
  vec3 size = 0.5 * (high - low) + kSlack;
  // Slopes of the rays through the image's borders; a focal length may be negative.
  vec2 ends_low = (vec2(-push.margin) - push.intrinsics.zw) / push.intrinsics.xy;
  vec2 ends_high = (vec2(push.width, push.height) + push.margin - push.intrinsics.zw) / push.intrinsics.xy;
  vec2 lower = min(ends_low, ends_high);
  vec2 upper = max(ends_low, ends_high);
  bool beyond = low.x > high.x || isBeyond(centre, size, vec3(0.0, 0.0, 1.0), 0.0) ||
                isBeyond(centre, size, vec3(0.0, 0.0, -1.0), push.max_depth) ||
                isBeyond(centre, size, vec3(1.0, 0.0, -lower.x), 0.0) ||
                isBeyond(centre, size, vec3(-1.0, 0.0, upper.x), 0.0) ||
                isBeyond(centre, size, vec3(0.0, 1.0, -lower.y), 0.0) ||
                isBeyond(centre, size, vec3(0.0, -1.0, upper.y), 0.0);
  if (!beyond) blocks[atomicAdd(block_header.x, 1u)] = block;
}

void main() {
  push = given;
  if (gl_GlobalInvocationID.x == 0u) block_header.yz = uvec2(1u);
  FOR_EACH_ITEM(push.count, visit)
}
