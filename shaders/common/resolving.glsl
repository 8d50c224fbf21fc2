// What each pixel of a prediction shows, if that is of this chunk. SHOWN_WORD picks the word of the look that is shown
// beside colour and confidence.
#include "common/items.glsl"
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2) uniform usamplerBuffer looks;
layout(binding = 3, r32ui) uniform readonly uimageBuffer keys;
layout(std430, binding = 4) writeonly buffer Surface { uvec4 surface[]; };
layout(std430, binding = 5) writeonly buffer Certainty { uvec2 certainty[]; };
#include "common/frame.glsl"
#include "common/surfel.glsl"
struct Push {
  FRAME_FIELDS
  float min_confidence;
  float max_depth;
  uint both_sides;
  uint base;    // of the chunk's rows
  uint count;   // rows of the chunk
  uint clears;  // 1: also writes what nobody shows
};
#include "common/push.glsl"
#include "common/pixel.glsl"
#include "common/disc.glsl"

const float kNormalSteps = 8388607.0;  // of a component from 0 to 1: 24 bits with its sign

// Words are what costs here, so each component of the normal has a byte of colour below it.
uvec3 packSurface(vec3 normal, uvec3 colour) {
  ivec3 steps = ivec3(floor(clamp(normal, -1.0, 1.0) * kNormalSteps + 0.5));
  return uvec3(steps) << 8 | colour;
}

void visit(uint i) {
  uint key = fetchWord(keys, i);
  bool shows = key != kNoWinner;
  uint surfel = shows ? (key & kSurfelMask) - push.base : 0u;
  vec4 place = fetch(places, surfel);
  uvec4 look = fetch(looks, surfel);
  Disc disc = discOf(place, fetch(shapes, surfel));
  vec3 ray = rayOf(vec2(pixelOf(i)));
  vec3 normal = dot(disc.normal, ray) > 0.0 ? -disc.normal : disc.normal;
  uvec3 colour = uvec3(clamp((colourOf(look) + 128.0) / 256.0, 0.0, 255.0));
  uvec4 words = uvec4(packSurface(normal, colour), floatBitsToUint(hit(disc, ray).x));
  surface[i] = shows ? words : uvec4(0u);
  certainty[i] = uvec2(floatBitsToUint(place.w), SHOWN_WORD(look));
}

void main() {
  push = given;
  uint first = firstItem();
  uint pixels = push.width * push.height;
  uint shown = 0u;
  for (uint k = 0u; k < 8u; ++k) {
    uint i = first + kItemStep * k;
    uint key = fetchWord(keys, min(i, pixels - 1u));
    bool own = key == kNoWinner ? push.clears != 0u : (key & kSurfelMask) - push.base < push.count;
    shown |= i < pixels && own ? 1u << k : 0u;
  }
  // Most chunks in view show few pixels. The loop is left at its end as that in common/items.glsl.
  for (;;) {
    if (shown != 0u) visit(first + kItemStep * uint(findLSB(shown)));
    shown &= shown - 1u;
    if (shown == 0u) break;
  }
}
