#include "fleet_tools/render/picture_legend.h"

#include <algorithm>
#include <array>
#include <vector>

#include "fleet_tools/render/picture_text.h"

namespace comap {
namespace {

constexpr std::array<Rgb, 8> kRobotColours = {Rgb{230, 85, 60},   Rgb{55, 125, 200}, Rgb{75, 170, 85},
                                              Rgb{240, 180, 40},  Rgb{150, 90, 180}, Rgb{60, 180, 180},
                                              Rgb{235, 120, 170}, Rgb{140, 100, 70}};

struct Entry {
  int left = 0, line = 0;
};

// From left to right; who does not fit begins a line.
std::vector<Entry> placesOf(std::span<const std::string> robots, int width, int side, int gap, int dot) {
  std::vector<Entry> entries;
  Entry next{gap, 0};
  for (const std::string& robot : robots) {
    const int wide = side + gap + textWidth_px(robot, dot);
    if (next.left > gap && next.left + wide + gap > width) next = {gap, next.line + 1};
    entries.push_back(next);
    next.left += wide + 3 * gap;
  }
  return entries;
}

}  // namespace

Rgb robotColour(size_t robot) { return kRobotColours[robot % kRobotColours.size()]; }

void drawLegend(ColourImage& picture, std::span<const std::string> robots) {
  const int side = std::max(8, picture.height() / 32), gap = side / 3;
  const int dot = std::max(1, side / (kLetterHeight_dots + 2));
  const std::vector<Entry> entries = placesOf(robots, picture.width(), side, gap, dot);
  for (size_t robot = 0; robot < entries.size(); ++robot) {
    const Entry& entry = entries[robot];
    const int top = picture.height() - (gap + side) * (entries.back().line - entry.line + 1);
    for (int y = top; y < top + side; ++y)
      for (int x = entry.left; x < entry.left + side; ++x)
        if (picture.contains(x, y)) picture.at(x, y) = robotColour(robot);
    drawText(picture, robots[robot], entry.left + side + gap, top + (side - (kLetterHeight_dots - 1) * dot) / 2, dot);
  }
}

}  // namespace comap
