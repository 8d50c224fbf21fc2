// Removes surfels: those the camera saw through, unsure ones that were not found again, and doubles of their pixel's
// winner. Reads match words, winners and their rows, place, shape, look and record; marks place and touched blocks,
// counts removals.
// Winners are never removed. One item = one visible surfel.
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
layout(std430, binding = 6) buffer Counters { uint counters[]; };  // a chunk: updated, removed
layout(std430, binding = 7) writeonly buffer Touched { uint touched[]; };
struct Push {
  FRAME_FIELDS
  float stable_confidence;
  uint unstable_timeout;
  uint base;  // of the chunk's rows
  uint chunk;
};
#include "common/push.glsl"

const float kDoubleReach = 0.6;       // of the smaller radius
const float kDoubleCosine = 0.866;    // 30 deg

vec4 winnerWords(uint first) {
  return vec4(uintBitsToFloat(winners[first]), uintBitsToFloat(winners[first + 1u]),
              uintBitsToFloat(winners[first + 2u]), uintBitsToFloat(winners[first + 3u]));
}

bool doubles(uint i, uint pixel) {
  vec4 place = places[i];
  vec4 shape = shapes[i];
  vec4 other = winnerWords(winnerRow(pixel));
  vec4 other_shape = winnerWords(winnerRow(pixel) + 4u);
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
    bool wins = (winner & kSurfelMask) == push.base + i;
    bool unstable = places[i].w < push.stable_confidence;
    uint misses = records[i].y & 0xffu;
    uint violations = records[i].y >> 8;
    uint patience = unstable ? 1u : clamp(observationsOf(looks[i]) / 2u, 2u, 5u);
    bool remove = flag == kViolated && violations >= patience;
    remove = remove || (unstable && misses > push.unstable_timeout);
    bool candidate = !remove && flag < kMissed && winner != kNoWinner && !wins;
    if (candidate) remove = doubles(i, word >> kPixelShift);
    if (flag < kMissed && wins && winner != kNoWinner) atomicAdd(counters[2u * push.chunk], 1u);
    if (remove) {
      places[i].w = kRemoved;
      touched[touchedBlock(i)] = 1u;
      atomicAdd(counters[2u * push.chunk + 1u], 1u);
    }
  }
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
