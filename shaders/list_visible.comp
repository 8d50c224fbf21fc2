// Lists the surfels whose centres lie before the camera and not far outside its image, so that the costlier kernels
// run for those only. The order of blocks in the list depends on scheduling; nothing that uses it depends on order.
// Reads place; writes the list. One workgroup = one block of 1024 rows that may be in view.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;
const int kVisibleBinding = 1;
#include "common/visible.glsl"
struct Push {
  FRAME_FIELDS
  uint count;
  float min_confidence;
  float max_depth;
  float margin;  // pixels around the image
};
#include "common/push.glsl"

bool isListed(uint i) { return true; }
#include "common/listing.glsl"
