// The surfels a camera may see, as list_visible left them. Needs kVisibleBinding.
layout(std430, binding = kVisibleBinding) buffer Visible {
  uvec4 visible_header;  // workgroups of 1024 (x, 1, 1), then the number of surfels
  uvec2 visible[];       // surfel, and its match word
};
#define FOR_EACH_VISIBLE(visit)                                                             \
  uint item_count = visible_header.w;                                                       \
  uint first_item = gl_WorkGroupID.x * 1024u + gl_LocalInvocationID.x;                      \
  for (uint item = first_item; item < first_item + 1024u; item += 128u) {                   \
    if (item < item_count) visit(item);                                                     \
  }
