// One direction of a bilateral filter on inverse depth, in which planes are linear; run for rows, then for columns.
// Neighbours enter in pairs from both sides, so that slanted surfaces are not pulled at edges, holes and borders.
// Reads inverse depth (0 = none, negative = too far to be fused), writes it filtered, 0 = none. One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/items.glsl"
layout(local_size_x = 128) in;
layout(binding = 0, r32f) uniform readonly imageBuffer inverse_depth;
layout(std430, binding = 1) writeonly buffer Output { float filtered[]; };
struct Push {
  uint width;
  uint height;
  uint along_columns;
  float noise_floor;
  float noise_factor;
};
#include "common/push.glsl"
#include "common/pixel.glsl"

const int kRadius = 6;
const float kSpatial = 0.0246914;  // 1 / (2 * 4.5^2)

void visit(uint i) {
  uvec2 pixel = pixelOf(i);
  int place = int(push.along_columns != 0u ? pixel.y : pixel.x);
  int size = int(push.along_columns != 0u ? push.height : push.width);
  int stride = int(push.along_columns != 0u ? push.width : 1u);
  float centre = fetchWord(inverse_depth, i);
  float sigma = 3.0 * (push.noise_floor * centre * centre + push.noise_factor);
  float range = 0.5 / (sigma * sigma);
  float sum = centre;
  float weights = 1.0;
  for (int k = 1; k <= kRadius; ++k) {
    bool inside = place >= k && place + k < size;
    int offset = inside ? k * stride : 0;
    float before = fetchWord(inverse_depth, int(i) - offset);
    float after = fetchWord(inverse_depth, int(i) + offset);
    float difference = max(abs(before - centre), abs(after - centre));
    float weight = exp(-(float(k * k) * kSpatial + difference * difference * range));
    weight = inside && before > 0.0 && after > 0.0 ? weight : 0.0;
    sum += weight * (before + after);
    weights += 2.0 * weight;
  }
  filtered[i] = centre > 0.0 ? sum / weights : 0.0;
}

void main() {
  push = given;
  FOR_EACH_ITEM(push.width * push.height, visit)
}
