// Marks the surfels that the current frame updated as seen by its camera now.
// Reads the list with its match words and the winners; updates times. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/surfel.glsl"
#include "common/times.glsl"
layout(local_size_x = 128) in;
const int kVisibleBinding = 0;
#include "common/visible.glsl"
layout(binding = 1, r32ui) uniform readonly uimageBuffer winners;
layout(std430, binding = 2) buffer Times { uvec4 times[]; };
struct Push {
  uint base;  // of the chunk's rows
  uint camera;
  uint tick;
};
#include "common/push.glsl"

void visit(uint item) {
  uint i = visible[item].x;
  uint word = visible[item].y;
  bool updated = (word & kFlagMask) == (kSupported | kFits) &&
                 (fetchWord(winners, word >> kPixelShift) & kSurfelMask) == push.base + i;
  if (updated) times[i] = withTick(times[i], push.camera, push.tick);
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
