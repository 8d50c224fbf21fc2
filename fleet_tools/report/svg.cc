#include "fleet_tools/report/svg.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/report/html.h"

namespace comap {

double gridStep(double wanted) {
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= wanted) return factor * power;
  }
  return 10 * power;
}

std::string gridNumber(double value, double step) {
  const int decimals = step < 0.1 ? 2 : step < 1 ? 1 : 0;
  return fixed(std::abs(value) < step / 2 ? 0 : value, decimals);
}

std::string svgNumber(double value) { return fixed(value, 1); }

std::string svgLine(double x1, double y1, double x2, double y2) {
  return "<line x1=\"" + svgNumber(x1) + "\" y1=\"" + svgNumber(y1) + "\" x2=\"" + svgNumber(x2) + "\" y2=\"" +
         svgNumber(y2) + "\"/>";
}

std::string svgText(double x, double y, const char* anchor, const std::string& text) {
  return "<text x=\"" + svgNumber(x) + "\" y=\"" + svgNumber(y) + "\" text-anchor=\"" + anchor + "\">" +
         htmlEscape(text) + "</text>";
}

std::string svgOpen(double height, const std::string& label) {
  return "<svg class=\"plot\" viewBox=\"0 0 " + svgNumber(kPlotWidth) + " " + svgNumber(height) +
         "\" role=\"img\" aria-label=\"" + htmlEscape(label) + "\">";
}

std::string colourClass(size_t colour) { return fmt::format("c{}", colour % 8); }

std::string legendEntry(size_t colour, const std::string& text) {
  return fmt::format("<span class=\"{}\"><i></i>{}</span>", colourClass(colour), htmlEscape(text));
}

}  // namespace comap
