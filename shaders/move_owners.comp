// Moves each surfel rigidly with the keyframe it belongs to. Reads look (owner) and three rows of T_new_old per owner;
// updates place and shape. Owners beyond the list stay. One item = one surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/items.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) buffer Places { vec4 places[]; };
layout(std430, binding = 1) buffer Shapes { vec4 shapes[]; };
layout(binding = 2) uniform usamplerBuffer looks;
layout(binding = 3) uniform samplerBuffer motions;
struct Push {
  uint count;
  uint owners;
};
#include "common/push.glsl"

void visit(uint i) {
  uint owner = fetch(looks, i).z;
  if (owner >= push.owners) return;
  vec4 row0 = fetch(motions, 3u * owner);
  vec4 row1 = fetch(motions, 3u * owner + 1u);
  vec4 row2 = fetch(motions, 3u * owner + 2u);
  vec4 x = vec4(places[i].xyz, 1.0);
  vec3 n = shapes[i].xyz;
  places[i].xyz = vec3(dot(row0, x), dot(row1, x), dot(row2, x));
  shapes[i].xyz = vec3(dot(row0.xyz, n), dot(row1.xyz, n), dot(row2.xyz, n));
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.count, visit)
}
