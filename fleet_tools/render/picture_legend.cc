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

struct Place {
  int left = 0, line = 0;
};

// From left to right; who does not fit begins a line.
std::vector<Place> placesOf(std::span<const LegendEntry> entries, int width, int side, int gap, int dot) {
  std::vector<Place> places;
  Place next{gap, 0};
  for (const LegendEntry& entry : entries) {
    const int wide = side + gap + textWidth_px(entry.name, dot);
    if (next.left > gap && next.left + wide + gap > width) next = {gap, next.line + 1};
    places.push_back(next);
    next.left += wide + 3 * gap;
  }
  return places;
}

}  // namespace

Rgb robotColour(size_t robot) { return kRobotColours[robot % kRobotColours.size()]; }

std::vector<LegendEntry> robotLegend(std::span<const std::string> robots) {
  std::vector<LegendEntry> entries;
  for (const std::string& robot : robots) entries.push_back({robotColour(entries.size()), robot});
  return entries;
}

void drawLegend(ColourImage& picture, std::span<const LegendEntry> entries) {
  const int side = std::max(8, picture.height() / 32), gap = side / 3;
  const int dot = std::max(1, side / (kLetterHeight_dots + 2));
  const std::vector<Place> places = placesOf(entries, picture.width(), side, gap, dot);
  for (size_t i = 0; i < places.size(); ++i) {
    const Place& place = places[i];
    const int top = picture.height() - (gap + side) * (places.back().line - place.line + 1);
    for (int y = top; y < top + side; ++y)
      for (int x = place.left; x < place.left + side; ++x)
        if (picture.contains(x, y)) picture.at(x, y) = entries[i].colour;
    drawText(picture, entries[i].name, place.left + side + gap, top + (side - (kLetterHeight_dots - 1) * dot) / 2, dot);
  }
}

}  // namespace comap
