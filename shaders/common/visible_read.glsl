// As common/visible.glsl, for kernels that only read the list. Needs kVisibleBinding and common/texels.glsl.
#include "common/items.glsl"
layout(binding = kVisibleBinding, r32ui) uniform readonly uimageBuffer visible_words;
#define visibleSurfel(item) fetchWord(visible_words, 4u + 2u * (item))
#define FOR_EACH_VISIBLE(visit) FOR_EACH_ITEM(fetchWord(visible_words, 3), visit)
