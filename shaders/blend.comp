// For pictures: adds up what the discs of the front surface show at each pixel, weighted by nearness to their centres.
// Sums are of whole numbers, so that order does not matter. Reads place, shape, look and the first pass's depths;
// adds to two sums per pixel: colour times weight and weight (255 at a centre), normal in the camera's frame times
// weight and confidence times weight. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2) uniform usamplerBuffer looks;
layout(binding = 3, r32ui) uniform readonly uimageBuffer depths;
const int kVisibleBinding = 4;
#include "common/visible_read.glsl"
layout(std430, binding = 5) buffer Colours { uint colour_sums[]; };
layout(std430, binding = 6) buffer Normals { int normal_sums[]; };
#include "common/frame.glsl"
#include "common/surfel.glsl"
struct Push {
  FRAME_FIELDS
  float min_confidence;
  float max_depth;
  uint both_sides;
  uint base;    // of the chunk's rows
  uint count;   // rows of the chunk
  uint clears;  // of resolve
};
#include "common/push.glsl"
#include "common/disc.glsl"

const float kFalloff = 3.0;  // weight exp(-3) at the rim

void visit(uint item) {
  uint i = visibleSurfel(item);
  vec4 place = fetch(places, i);
  Disc disc = discOf(place, fetch(shapes, i));
  int confidence = int(min(place.w, 255.0) * 16.0 + 0.5);
  uvec3 colour = uvec3(clamp((colourOf(fetch(looks, i)) + 128.0) / 256.0, 0.0, 255.0));
  int last = disc.visible ? disc.high.y : -1;
  for (int y = disc.low.y; y <= last; ++y) {
    for (int x = disc.low.x; x <= disc.high.x; ++x) {
      vec3 ray = rayOf(vec2(x, y));
      vec2 at = hit(disc, ray);
      uint pixel = uint(y) * push.width + uint(x);
      float front = uintBitsToFloat(fetchWord(depths, pixel));
      if (at.y <= 1.0 && at.x > 0.0 && at.x <= front + gateOf(front)) {
        float weight = 255.0 * exp(-kFalloff * at.y);
        uint whole = uint(weight + 0.5);
        ivec3 normal = ivec3(round((dot(disc.normal, ray) > 0.0 ? -disc.normal : disc.normal) * weight * 16.0));
        for (int k = 0; k < 3; ++k) {
          atomicAdd(colour_sums[4u * pixel + k], colour[k] * whole);
          atomicAdd(normal_sums[4u * pixel + k], normal[k]);
        }
        atomicAdd(colour_sums[4u * pixel + 3u], whole);
        atomicAdd(normal_sums[4u * pixel + 3u], confidence * int(whole));
      }
    }
  }
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
