// The surfels a camera may see, as list_visible left them. Needs kVisibleBinding.
#include "common/items.glsl"
layout(std430, binding = kVisibleBinding) buffer Visible {
  uvec4 visible_header;  // workgroups of 1024 (x, 1, 1), then the number of surfels
  uvec2 visible[];       // surfel, and its match word
};
#define FOR_EACH_VISIBLE(visit) FOR_EACH_ITEM(visible_header.w, visit)
