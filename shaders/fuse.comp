// Averages each winning surfel with its pixel's measurement; records for the others whether they were missed.
// Reads match words, winners, measurements and colour; updates place, shape, look and record, marks touched blocks.
// The surfel moves along the measured normal only: it stays in its lattice. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/surfel.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) buffer Places { vec4 places[]; };
layout(std430, binding = 1) buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 2) buffer Looks { uvec4 looks[]; };
layout(std430, binding = 3) buffer Records { uvec2 records[]; };
layout(binding = 4) uniform samplerBuffer measurements;
layout(binding = 5, r32ui) uniform readonly uimageBuffer colours;
const int kVisibleBinding = 6;
#include "common/visible.glsl"
layout(std430, binding = 7) buffer Winners { uint winners[]; };
layout(std430, binding = 8) writeonly buffer Touched { uint touched[]; };
struct Push {
  FRAME_FIELDS
  float averaging_limit;
  uint contributor;
  uint base;  // of the chunk's rows
};
#include "common/push.glsl"
#include "common/pixel.glsl"
#include "common/measurement.glsl"

vec3 colourAt(ivec2 pixel) {
  ivec2 inside = clamp(pixel, ivec2(0), ivec2(push.width, push.height) - 1);
  uint c = fetchWord(colours, inside.y * int(push.width) + inside.x);
  return vec3(c & 0xffu, c >> 8 & 0xffu, c >> 16 & 0xffu) * 256.0;
}

vec3 interpolatedColour(vec2 at) {
  ivec2 corner = ivec2(floor(at));
  vec2 part = at - vec2(corner);
  vec3 upper = mix(colourAt(corner), colourAt(corner + ivec2(1, 0)), part.x);
  vec3 lower = mix(colourAt(corner + ivec2(0, 1)), colourAt(corner + ivec2(1, 1)), part.x);
  return mix(upper, lower, part.y);
}

void update(uint i, uint index) {
  vec4 place = places[i];
  vec4 shape = shapes[i];
  uvec4 look = looks[i];
  float precision_sum = uintBitsToFloat(records[i].x);
  vec4 m = fetch(measurements, index);
  float frames = framesOf(fetchWord(colours, index));
  vec2 pixel = vec2(pixelOf(index));
  vec3 position = toCamera(place.xyz);
  float radius = radiusOf(m.w, m.z);
  vec3 colour = colourOf(look);
  if (radius < 1.5 * shape.w) {
    float weight = precisionOf(pixel, m.w, frames);
    float share = weight / (min(precision_sum, push.averaging_limit) + weight);
    vec3 shift = m.xyz * dot(m.xyz, rayOf(pixel) * m.w - position);
    place.xyz += rotateToMap(shift) * share;
    shape.xyz = normalize(mix(shape.xyz, rotateToMap(m.xyz), share));
    shape.w = mix(shape.w, radius, share);
    colour = mix(colour, interpolatedColour(project(position)), share);
    precision_sum += weight;
  }
  place.w += confidenceOf(frames);
  places[i] = place;
  shapes[i] = shape;
  touched[touchedBlock(i)] = 1u;  // whoever else writes there writes the same
  uint row = winnerRow(index);
  for (uint k = 0u; k < 4u; ++k) {
    winners[row + k] = floatBitsToUint(place[k]);
    winners[row + 4u + k] = floatBitsToUint(shape[k]);
  }
  looks[i] = packLook(colour, observationsOf(look) + 1u, look.z, look.w | push.contributor);
  records[i].x = floatBitsToUint(precision_sum);
}

void visit(uint item) {
  uint i = visible[item].x;
  uint word = visible[item].y;
  uint flag = word & kFlagMask;
  uint index = word >> kPixelShift;
  if (flag != 0u) {
    bool wins = (flag & (kSupported | kFits)) == (kSupported | kFits) && flag < kMissed &&
                (winners[index] & kSurfelMask) == push.base + i;
    uint memory = records[i].y;
    uint misses = memory & 0xffu;
    uint violations = memory >> 8;
    misses = flag >= kMissed ? min(misses + 1u, 255u) : 0u;
    violations = flag == kViolated ? min(violations + 1u, 255u)
                                   : (flag < kMissed && violations > 0u ? violations - 1u : violations);
    records[i].y = misses | violations << 8;
    if (wins) update(i, index);
  }
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
