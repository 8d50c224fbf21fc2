// Removes surfels: those the camera saw through, unsure ones that were not found again, and doubles of their pixel's
// winner. Reads match words, winners, place, shape, look and record; marks place, counts removals.
// Winners are never removed, so the surfel compared with does not change meanwhile. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/frame.glsl"
#include "common/surfel.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) buffer Places { vec4 places[]; };
layout(std430, binding = 1) readonly buffer Shapes { vec4 shapes[]; };
layout(std430, binding = 2) readonly buffer Looks { uvec4 looks[]; };
layout(std430, binding = 3) readonly buffer Records { uvec2 records[]; };
const int kVisibleBinding = 4;
#include "common/visible.glsl"
layout(std430, binding = 5) readonly buffer Winners { uint winners[]; };
layout(std430, binding = 6) buffer Counters { uint updated; uint removed; uint inserted; } counters;
layout(push_constant) uniform Push {
  FRAME_FIELDS
  float stable_confidence;
  uint unstable_timeout;
} push;

const float kDoubleReach = 0.6;       // of the smaller radius
const float kDoubleCosine = 0.866;    // 30 deg

bool doubles(uint i, uint winner) {
  vec4 place = places[i];
  vec4 shape = shapes[i];
  vec4 other = places[winner];
  vec4 other_shape = shapes[winner];
  vec3 offset = place.xyz - other.xyz;
  float height = dot(offset, other_shape.xyz);
  float reach = kDoubleReach * min(shape.w, other_shape.w);
  float gate = gateOf(toCamera(place.xyz).z);
  return dot(offset, offset) - height * height < reach * reach && abs(height) < gate &&
         dot(shape.xyz, other_shape.xyz) > kDoubleCosine && other.w >= place.w;
}

void visit(uint item) {
  uint i = visible[item].x;
  uint word = visible[item].y;
  uint flag = word & kFlagMask;
  if (flag != 0u) {
    uint winner = winners[word >> kPixelShift];
    bool wins = (winner & kSurfelMask) == i;
    bool unstable = places[i].w < push.stable_confidence;
    uint misses = records[i].y & 0xffu;
    uint violations = records[i].y >> 8;
    uint patience = unstable ? 1u : clamp(observationsOf(looks[i]) / 2u, 2u, 5u);
    bool remove = flag == kViolated && violations >= patience;
    remove = remove || (unstable && misses > push.unstable_timeout);
    bool candidate = !remove && flag < kMissed && winner != kNoWinner && !wins;
    if (candidate) remove = doubles(i, winner & kSurfelMask);
    if (flag < kMissed && wins && winner != kNoWinner) atomicAdd(counters.updated, 1u);
    if (remove) {
      places[i].w = kRemoved;
      atomicAdd(counters.removed, 1u);
    }
  }
}

void main() { FOR_EACH_VISIBLE(visit) }
