// The pieces that every plot of a page is drawn with.
#pragma once

#include <string>

namespace comap {

/// Width of a plot, in the units of its view box.
inline constexpr double kPlotWidth = 820;

/// 1, 2 or 5 times a power of ten, the smallest that is not less than `wanted` > 0.
double gridStep(double wanted);

/// With so many decimals as a grid of that step needs; no -0.
std::string gridNumber(double value, double step);

/// One decimal: a tenth of a pixel.
std::string svgNumber(double value);

std::string svgLine(double x1, double y1, double x2, double y2);

/// `text` is escaped; `anchor`: start, middle or end.
std::string svgText(double x, double y, const char* anchor, const std::string& text);

/// The head of a plot of kPlotWidth by `height`; `label` says to a screen reader what it shows.
std::string svgOpen(double height, const std::string& label);

/// The class that has the colour of robot number `colour`.
std::string colourClass(size_t colour);

/// An entry of a legend.
std::string legendEntry(size_t colour, const std::string& text);

}  // namespace comap
