// Words in a picture, in letters of dots.
#pragma once

#include <string>

#include "protocol/types/image.h"

namespace comap {

inline constexpr int kLetterWidth_dots = 5, kLetterHeight_dots = 8;

/// How wide `text` becomes with dots of `dot_px` pixels.
int textWidth_px(const std::string& text, int dot_px);

/// Writes `text` in dark letters with a light rim, to be read on any ground; `left`, `top` of the first letter. Letters
/// are those of robots' names; any other character is a box. What would lie outside the picture is left out.
void drawText(ColourImage& picture, const std::string& text, int left, int top, int dot_px);

}  // namespace comap
