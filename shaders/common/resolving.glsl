// What each pixel of a prediction shows, if that is of this chunk. SHOWN_WORD picks the word of the look that is shown
// beside colour and confidence.
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2) uniform usamplerBuffer looks;
layout(binding = 3, r32ui) uniform readonly uimageBuffer keys;
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
  uint group;  // of chunks whose keys are compared with each other
};
#include "common/push.glsl"
#include "common/pixel.glsl"
#include "common/disc.glsl"

void visit(uint i) {
  uint key = fetchWord(keys, i);
  bool empty = key == kNoWinner;
  uint surfel = empty ? 0u : (key & kSurfelMask) - push.base;
  uint rank = key >> kRankShift;
  if (push.group > 0u && rank >= appearance[i].w) return;
  vec4 place = fetch(places, surfel);
  uvec4 look = fetch(looks, surfel);
  Disc disc = discOf(place, fetch(shapes, surfel));
  vec3 ray = rayOf(vec2(pixelOf(i)));
  vec3 normal = dot(disc.normal, ray) > 0.0 ? -disc.normal : disc.normal;
  uvec3 colour = uvec3(clamp((colourOf(look) + 128.0) / 256.0, 0.0, 255.0));
  surface[i] = empty ? vec4(0.0) : vec4(normal, hit(disc, ray).x);
  appearance[i] = uvec4(colour.r | colour.g << 8 | colour.b << 16, floatBitsToUint(place.w), SHOWN_WORD(look), rank);
}

void main() {
  push = given;
  uint first = gl_WorkGroupID.x * 1024u + gl_LocalInvocationID.x;
  uint pixels = push.width * push.height;
  bool clears = push.base == 0u && push.group == 0u;  // the first of all: it writes what nobody shows
  uint shown = 0u;
  for (uint k = 0u; k < 8u; ++k) {
    uint i = first + 128u * k;
    uint key = fetchWord(keys, min(i, pixels - 1u));
    bool own = key == kNoWinner ? clears : (key & kSurfelMask) - push.base < push.count;
    shown |= i < pixels && own ? 1u << k : 0u;
  }
  // Most chunks in view show few pixels.
  for (; shown != 0u; shown &= shown - 1u) visit(first + 128u * uint(findLSB(shown)));
}
