// What each pixel of a prediction shows, if that is of this chunk. SHOWN_WORD picks the word of the look that is shown
// beside colour and confidence.
#include "common/items.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 2) readonly buffer Looks { uvec4 looks[]; };
layout(std430, binding = 3) readonly buffer Keys { uint keys[]; };
layout(std430, binding = 4) writeonly buffer Surface { vec4 surface[]; };
layout(std430, binding = 5) buffer Appearance { uvec4 appearance[]; };
#include "common/frame.glsl"
#include "common/surfel.glsl"
struct Push {
  FRAME_FIELDS
  float min_confidence;
  float max_depth;
  uint both_sides;
  uint base;   // of the chunk's rows
  uint count;  // rows of the chunk
};
#include "common/push.glsl"
#include "common/disc.glsl"

void visit(uint i) {
  uint key = keys[i];
  uint surfel = (key & kSurfelMask) - push.base;
  uint rank = key >> kRankShift;
  if (key == kNoWinner || surfel >= push.count || rank >= appearance[i].w) return;
  vec4 place = places[surfel];
  uvec4 look = looks[surfel];
  Disc disc = discOf(place, shapes[surfel]);
  vec3 ray = rayOf(vec2(i % push.width, i / push.width));
  vec3 normal = dot(disc.normal, ray) > 0.0 ? -disc.normal : disc.normal;
  uvec3 colour = uvec3(clamp((colourOf(look) + 128.0) / 256.0, 0.0, 255.0));
  surface[i] = vec4(normal, hit(disc, ray).x);
  appearance[i] = uvec4(colour.r | colour.g << 8 | colour.b << 16, floatBitsToUint(place.w), SHOWN_WORD(look), rank);
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.width * push.height, visit)
}
