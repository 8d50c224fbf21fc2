#include "fleet_tools/report/error_plot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fleet_tools/report/html.h"
#include "fleet_tools/report/svg.h"

namespace comap {
namespace {

constexpr double kHeight = 260, kLeft = 46, kBottom = 24, kTop = 14, kRight = 10;
constexpr size_t kMaxPoints = 3000;  // per robot
constexpr double kGap_s = 1, kMaxTime_s = 1e7, kMaxError_m = 1e6;

struct Axes {
  double seconds = 0, millimetres = 0;
  double x(double t_s) const { return kLeft + (kPlotWidth - kLeft - kRight) * t_s / seconds; }
  double y(double mm) const { return kTop + (kHeight - kTop - kBottom) * (1 - mm / millimetres); }
};

// Time since the first sample; what is not finite, or absurd, is left out.
std::vector<ReportError> usable(const std::vector<ReportError>& errors) {
  std::vector<ReportError> samples;
  for (const ReportError& error : errors) {
    if (!std::isfinite(error.t_s) || !std::isfinite(error.error_m) || std::abs(error.error_m) > kMaxError_m) continue;
    const double since = samples.empty() ? 0 : error.t_s - errors.front().t_s;
    if (since >= 0 && since < kMaxTime_s) samples.push_back({since, std::abs(error.error_m)});
  }
  return samples;
}

std::string grid(const Axes& axes) {
  std::string lines = "<g class=\"grid\">", labels = "<g class=\"axis\">";
  const double across = gridStep(axes.seconds / 8), up = gridStep(axes.millimetres / 4);
  for (double t = 0; t <= axes.seconds; t += across) {
    lines += svgLine(axes.x(t), kTop, axes.x(t), kHeight - kBottom);
    labels += svgText(axes.x(t), kHeight - 7, "middle", gridNumber(t, across));
  }
  for (double mm = 0; mm <= axes.millimetres; mm += up) {
    lines += svgLine(kLeft, axes.y(mm), kPlotWidth - kRight, axes.y(mm));
    labels += svgText(kLeft - 6, axes.y(mm) + 4, "end", gridNumber(mm, up));
  }
  return lines + "</g>" + labels + "</g>";
}

std::string lines(const std::vector<ReportError>& samples, const Axes& axes) {
  // Of a group of samples the worst is drawn: a peak must not vanish between two points.
  const size_t stride = (samples.size() + kMaxPoints - 1) / kMaxPoints;
  std::string html, points;
  const auto close = [&] {
    if (!points.empty()) html += "<polyline style=\"stroke-width:1.6\" points=\"" + points + "\"/>";
    points.clear();
  };
  for (size_t i = 0; i < samples.size(); i += stride) {
    const auto end = samples.begin() + static_cast<std::ptrdiff_t>(std::min(i + stride, samples.size()));
    const auto worst = std::max_element(samples.begin() + static_cast<std::ptrdiff_t>(i), end,
                                        [](const auto& a, const auto& b) { return a.error_m < b.error_m; });
    if (i > 0 && samples[i].t_s - samples[i - 1].t_s > kGap_s) close();
    points.append(svgNumber(axes.x(worst->t_s)))
        .append(",")
        .append(svgNumber(axes.y(1000 * worst->error_m)))
        .append(" ");
  }
  close();
  return html;
}

}  // namespace

std::string errorPlot(std::span<const ReportTrajectory> trajectories) {
  Axes axes;
  std::vector<std::vector<ReportError>> samples;
  for (const ReportTrajectory& trajectory : trajectories) {
    for (const ReportError& error : samples.emplace_back(usable(trajectory.errors))) {
      axes.seconds = std::max(axes.seconds, error.t_s);
      axes.millimetres = std::max(axes.millimetres, 1000 * error.error_m);
    }
  }
  if (std::all_of(samples.begin(), samples.end(), [](const auto& s) { return s.empty(); })) return "";
  axes.seconds = std::max(axes.seconds, 0.1);
  axes.millimetres = 1.05 * std::max(axes.millimetres, 0.1);
  std::string svg = svgOpen(kHeight, "Error over time") + grid(axes), legend = "<p class=\"legend\">";
  for (size_t i = 0; i < trajectories.size(); ++i) {
    if (samples[i].empty()) continue;
    svg += "<g class=\"" + colourClass(trajectories[i].colour) + "\"><title>" + htmlEscape(trajectories[i].robot) +
           "</title>" + lines(samples[i], axes) + "</g>";
    legend += legendEntry(trajectories[i].colour, trajectories[i].robot);
  }
  return svg + "</svg>" + legend +
         "<span class=\"note\">millimetres, over the seconds since each robot's first pose</span></p>";
}

}  // namespace comap
