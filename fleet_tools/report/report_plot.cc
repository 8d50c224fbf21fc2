#include "fleet_tools/report/report_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/report/html.h"

namespace comap {
namespace {

constexpr double kWidth = 820, kMinHeight = 260, kMaxHeight = 620, kMargin = 42;
constexpr size_t kMaxPoints = 3000;  // per robot: more than a screen resolves
constexpr double kMaxExtent_m = 1e7;

struct View {
  double x_min = 0, x_max = 0, z_min = 0, z_max = 0;  // metres
  double scale = 1;                                   // pixels per metre
  double height = 0;
  double u(double x) const { return 0.5 * kWidth + (x - 0.5 * (x_min + x_max)) * scale; }
  double v(double z) const { return 0.5 * height - (z - 0.5 * (z_min + z_max)) * scale; }
};

bool isUsable(const Eigen::Vector3d& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxExtent_m; }

std::string number(double value) { return fixed(value, 1); }

View viewOf(std::span<const ReportTrajectory* const> trajectories) {
  View view;
  bool any = false;
  for (const ReportTrajectory* trajectory : trajectories) {
    for (const Eigen::Vector3d& p : trajectory->positions) {
      if (!isUsable(p)) continue;
      view.x_min = any ? std::min(view.x_min, p.x()) : p.x();
      view.x_max = any ? std::max(view.x_max, p.x()) : p.x();
      view.z_min = any ? std::min(view.z_min, p.z()) : p.z();
      view.z_max = any ? std::max(view.z_max, p.z()) : p.z();
      any = true;
    }
  }
  if (!any) return view;
  const double wide = std::max(view.x_max - view.x_min, 0.5), deep = std::max(view.z_max - view.z_min, 0.5);
  view.height = std::clamp((kWidth - 2 * kMargin) * deep / wide + 2 * kMargin, kMinHeight, kMaxHeight);
  view.scale = std::min((kWidth - 2 * kMargin) / wide, (view.height - 2 * kMargin) / deep);
  return view;
}

// 1, 2 or 5 times a power of ten, so that lines are some 80 pixels apart.
double gridStep(double scale) {
  const double wanted = 80 / scale;
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= wanted) return factor * power;
  }
  return 10 * power;
}

std::string line(double x1, double y1, double x2, double y2) {
  return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
         "\"/>";
}

std::string label(double x, double y, const char* anchor, double metres, double step) {
  const int decimals = step < 0.1 ? 2 : step < 1 ? 1 : 0;
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\">" +
         fixed(std::abs(metres) < step / 2 ? 0 : metres, decimals) + "</text>";
}

std::string grid(const View& view) {
  const double step = gridStep(view.scale);
  const double half_x = 0.5 * kWidth / view.scale, half_z = 0.5 * view.height / view.scale;
  const double x_mid = 0.5 * (view.x_min + view.x_max), z_mid = 0.5 * (view.z_min + view.z_max);
  std::string lines = "<g class=\"grid\">", labels = "<g class=\"axis\">";
  for (double i = std::ceil((x_mid - half_x) / step); i * step <= x_mid + half_x; ++i) {
    const double u = view.u(i * step);
    lines += line(u, 0, u, view.height);
    if (u > 30 && u < kWidth - 30) labels += label(u, view.height - 6, "middle", i * step, step);
  }
  for (double i = std::ceil((z_mid - half_z) / step); i * step <= z_mid + half_z; ++i) {
    const double v = view.v(i * step);
    lines += line(0, v, kWidth, v);
    if (v > 12 && v < view.height - 24) labels += label(5, v - 3, "start", i * step, step);
  }
  return lines + "</g>" + labels + "</g>";
}

std::string path(const ReportTrajectory& trajectory, size_t colour, const View& view) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : trajectory.positions) {
    if (isUsable(p)) points.push_back(p);
  }
  if (points.empty()) return "";
  const size_t stride = (points.size() + kMaxPoints - 1) / kMaxPoints;
  std::string list;
  const auto append = [&](const Eigen::Vector3d& p) {
    list.append(number(view.u(p.x()))).append(",").append(number(view.v(p.z()))).append(" ");
  };
  for (size_t i = 0; i < points.size(); i += stride) append(points[i]);
  const Eigen::Vector3d& first = points.front();
  const Eigen::Vector3d& last = points.back();
  if ((points.size() - 1) % stride != 0) append(last);
  return "<g class=\"c" + std::to_string(colour) + "\"><title>" + htmlEscape(trajectory.robot) +
         "</title><polyline points=\"" + list + "\"/><circle cx=\"" + number(view.u(first.x())) + "\" cy=\"" +
         number(view.v(first.z())) + "\" r=\"5\"/><rect x=\"" + number(view.u(last.x()) - 4.5) + "\" y=\"" +
         number(view.v(last.z()) - 4.5) + "\" width=\"9\" height=\"9\"/></g>";
}

}  // namespace

std::string trajectoryPlot(std::span<const ReportTrajectory* const> trajectories) {
  const View view = viewOf(trajectories);
  if (view.height <= 0) return "";
  std::string svg = "<svg class=\"plot\" viewBox=\"0 0 " + number(kWidth) + " " + number(view.height) +
                    "\" role=\"img\" aria-label=\"Trajectories from above\">" + grid(view);
  std::string legend = "<p class=\"legend\">";
  for (size_t i = 0; i < trajectories.size(); ++i) {
    svg += path(*trajectories[i], i % 8, view);
    legend += "<span class=\"c" + std::to_string(i % 8) + "\"><i></i>" + htmlEscape(trajectories[i]->robot) + "</span>";
  }
  return svg + "</svg>" + legend + "<span class=\"note\">circle: start, square: end; metres</span></p>";
}

}  // namespace comap
