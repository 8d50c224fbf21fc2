// Depth and normal of each pixel that shows a surface well enough to be fused.
// Reads filtered inverse depth; writes normal (in the camera's frame, towards it) and depth, 0 = not to be fused.
// One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/items.glsl"
layout(local_size_x = 128) in;
layout(binding = 0, r32f) uniform readonly imageBuffer inverse_depth;
layout(std430, binding = 1) writeonly buffer Output { vec4 measurements[]; };
struct Push {
  FRAME_FIELDS
};
#include "common/push.glsl"
#include "common/pixel.glsl"

const int kStep = 2;                // pixels to the neighbours
const float kSlope = 5.67;          // tan 80 deg: steeper is a depth edge
const float kBend = 2.0;            // change of slope that a surface may have over one step
const float kGrazingCosine = 0.17;  // 80 deg

void visit(uint i) {
  ivec2 pixel = ivec2(pixelOf(i));
  bool inside = pixel.x >= kStep && pixel.y >= kStep && pixel.x + kStep < int(push.width) &&
                pixel.y + kStep < int(push.height);
  int dx = inside ? kStep : 0;
  int dy = inside ? kStep * int(push.width) : 0;
  float centre = fetchWord(inverse_depth, i);
  float left = fetchWord(inverse_depth, int(i) - dx);
  float right = fetchWord(inverse_depth, int(i) + dx);
  float up = fetchWord(inverse_depth, int(i) - dy);
  float down = fetchWord(inverse_depth, int(i) + dy);
  bool valid = inside && centre > 0.0 && min(min(left, right), min(up, down)) > 0.0;

  float sigma = push.noise_floor * centre * centre + push.noise_factor;
  float per_slope = float(kStep) * centre / focalLength();
  float edge = max(max(abs(left - centre), abs(right - centre)), max(abs(up - centre), abs(down - centre)));
  float bend = max(abs(left + right - 2.0 * centre), abs(up + down - 2.0 * centre));
  valid = valid && edge < 3.0 * sigma + kSlope * per_slope && bend < 2.0 * sigma + kBend * per_slope;

  vec2 p = vec2(pixel);
  vec3 horizontal = rayOf(p + vec2(kStep, 0)) / right - rayOf(p - vec2(kStep, 0)) / left;
  vec3 vertical = rayOf(p + vec2(0, kStep)) / down - rayOf(p - vec2(0, kStep)) / up;
  vec3 normal = cross(horizontal, vertical);
  vec3 ray = normalize(rayOf(p));
  float cosine = dot(normal, ray) / length(normal);
  valid = valid && abs(cosine) > kGrazingCosine;
  normal = normalize(cosine > 0.0 ? -normal : normal);
  measurements[i] = valid ? vec4(normal, 1.0 / centre) : vec4(0.0);
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.width * push.height, visit)
}
