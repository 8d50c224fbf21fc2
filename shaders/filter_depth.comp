// One direction of a bilateral filter on inverse depth, in which planes are linear; run for rows, then for columns.
// Reads inverse depth (0 = none), writes it filtered. One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/items.glsl"
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Input { float inverse_depth[]; };
layout(std430, binding = 1) writeonly buffer Output { float filtered[]; };
layout(push_constant) uniform Push {
  uint width;
  uint height;
  uint along_columns;
  float noise_floor;
  float noise_factor;
} push;

const int kRadius = 6;
const float kSpatial = 0.0246914;  // 1 / (2 * 4.5^2)

void visit(uint i) {
  int place = int(push.along_columns != 0u ? i / push.width : i % push.width);
  int size = int(push.along_columns != 0u ? push.height : push.width);
  int stride = int(push.along_columns != 0u ? push.width : 1u);
  float centre = inverse_depth[i];
  float sigma = 3.0 * (push.noise_floor * centre * centre + push.noise_factor);
  float range = 0.5 / (sigma * sigma);
  float sum = 0.0;
  float weights = 0.0;
  for (int k = -kRadius; k <= kRadius; ++k) {
    bool inside = place + k >= 0 && place + k < size;
    float value = inverse_depth[int(i) + (inside ? k * stride : 0)];
    float difference = value - centre;
    float weight = exp(-(float(k * k) * kSpatial + difference * difference * range));
    weight = inside && value > 0.0 ? weight : 0.0;
    sum += weight * value;
    weights += weight;
  }
  filtered[i] = centre > 0.0 ? sum / weights : 0.0;
}

void main() { FOR_EACH_ITEM(push.width * push.height, visit) }
