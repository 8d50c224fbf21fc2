// What the colours of a picture stand for, at its foot.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "protocol/types/image.h"

namespace comap {

/// The colour of the robot that is at this place by name (robot_order.h).
Rgb robotColour(size_t robot);

struct LegendEntry {
  Rgb colour;
  std::string name;  ///< in the letters that drawText() has
};

/// Robots by name, each with its colour.
std::vector<LegendEntry> robotLegend(std::span<const std::string> robots);

/// A square of each colour with its name, in as many lines as they need.
void drawLegend(ColourImage& picture, std::span<const LegendEntry> entries);

}  // namespace comap
