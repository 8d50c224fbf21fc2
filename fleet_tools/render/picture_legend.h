// Which robot a colour stands for, at the foot of a picture.
#pragma once

#include <span>
#include <string>

#include "protocol/types/image.h"

namespace comap {

/// The colour that stands for contributor bit `robot`.
Rgb robotColour(size_t robot);

/// A square of each robot's colour with its name, in as many lines as they need; the names by contributor bit.
void drawLegend(ColourImage& picture, std::span<const std::string> robots);

}  // namespace comap
