// As list_visible.comp, for one camera of a map whose surfels know when each camera last saw them: only those it has
// seen lately (active), or only all others (inactive). Reads place and times; writes the list. One workgroup = 1024
// surfels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/times.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
const int kVisibleBinding = 1;
#include "common/visible.glsl"
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;
layout(binding = 3) uniform usamplerBuffer times;
struct Push {
  FRAME_FIELDS
  uint count;
  float min_confidence;
  float max_depth;
  float margin;  // pixels around the image
  uint camera;
  uint tick;
  uint window;
  uint inactive;  // which are wanted
};
#include "common/push.glsl"

bool isListed(uint i) {
  uint seen = tickOf(fetch(times, i), push.camera);
  bool active_ = seen > 0u && push.tick - seen <= push.window;
  return active_ == (push.inactive == 0u);
}
#include "common/listing.glsl"
