// As common/visible.glsl, for kernels that only read the list. Needs kVisibleBinding and common/texels.glsl.
layout(binding = kVisibleBinding, r32ui) uniform readonly uimageBuffer visible_words;
#define visibleSurfel(item) fetchWord(visible_words, 4u + 2u * (item))

// The loop is left at its end, see common/footprint.glsl.
#define FOR_EACH_VISIBLE(visit)                                                             \
  uint item_count = fetchWord(visible_words, 3);                                            \
  uint first_item = gl_WorkGroupID.x * 1024u + gl_LocalInvocationID.x;                      \
  uint item = first_item;                                                                   \
  for (;;) {                                                                                \
    if (item < item_count) visit(item);                                                     \
    item += 128u;                                                                           \
    if (item >= first_item + 1024u) break;                                                  \
  }
