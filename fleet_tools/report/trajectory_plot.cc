#include "fleet_tools/report/trajectory_plot.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "fleet_tools/report/html.h"
#include "fleet_tools/report/svg.h"

namespace comap {
namespace {

constexpr double kWidth = kPlotWidth, kMinHeight = 260, kMaxHeight = 620, kMargin = 42;
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

View viewOf(std::span<const ReportTrajectory* const> trajectories) {
  View view;
  bool any = false;
  for (const ReportTrajectory* trajectory : trajectories) {
    for (const auto* line : {&trajectory->positions, &trajectory->truth}) {
      for (const Eigen::Vector3d& p : *line) {
        if (!isUsable(p)) continue;
        view.x_min = any ? std::min(view.x_min, p.x()) : p.x();
        view.x_max = any ? std::max(view.x_max, p.x()) : p.x();
        view.z_min = any ? std::min(view.z_min, p.z()) : p.z();
        view.z_max = any ? std::max(view.z_max, p.z()) : p.z();
        any = true;
      }
    }
  }
  if (!any) return view;
  const double wide = std::max(view.x_max - view.x_min, 0.5), deep = std::max(view.z_max - view.z_min, 0.5);
  view.height = std::clamp((kWidth - 2 * kMargin) * deep / wide + 2 * kMargin, kMinHeight, kMaxHeight);
  view.scale = std::min((kWidth - 2 * kMargin) / wide, (view.height - 2 * kMargin) / deep);
  return view;
}

std::string grid(const View& view) {
  const double step = gridStep(80 / view.scale);
  const double half_x = 0.5 * kWidth / view.scale, half_z = 0.5 * view.height / view.scale;
  const double x_mid = 0.5 * (view.x_min + view.x_max), z_mid = 0.5 * (view.z_min + view.z_max);
  std::string lines = "<g class=\"grid\">", labels = "<g class=\"axis\">";
  for (double i = std::ceil((x_mid - half_x) / step); i * step <= x_mid + half_x; ++i) {
    const double u = view.u(i * step);
    lines += svgLine(u, 0, u, view.height);
    if (u > 30 && u < kWidth - 30) labels += svgText(u, view.height - 6, "middle", gridNumber(i * step, step));
  }
  for (double i = std::ceil((z_mid - half_z) / step); i * step <= z_mid + half_z; ++i) {
    const double v = view.v(i * step);
    lines += svgLine(0, v, kWidth, v);
    if (v > 12 && v < view.height - 24) labels += svgText(5, v - 3, "start", gridNumber(i * step, step));
  }
  return lines + "</g>" + labels + "</g>";
}

std::vector<Eigen::Vector3d> usable(const std::vector<Eigen::Vector3d>& positions) {
  std::vector<Eigen::Vector3d> points;
  std::copy_if(positions.begin(), positions.end(), std::back_inserter(points), isUsable);
  return points;
}

// Not more than kMaxPoints of the points, the last one among them; empty for none.
std::string polyline(const std::vector<Eigen::Vector3d>& points, const char* kind, const View& view) {
  if (points.empty()) return "";
  const size_t stride = (points.size() + kMaxPoints - 1) / kMaxPoints;
  std::string list;
  const auto append = [&](const Eigen::Vector3d& p) {
    list.append(svgNumber(view.u(p.x()))).append(",").append(svgNumber(view.v(p.z()))).append(" ");
  };
  for (size_t i = 0; i < points.size(); i += stride) append(points[i]);
  if ((points.size() - 1) % stride != 0) append(points.back());
  return "<polyline" + std::string(kind) + " points=\"" + list + "\"/>";
}

std::string path(const ReportTrajectory& trajectory, const View& view) {
  const std::vector<Eigen::Vector3d> points = usable(trajectory.positions);
  if (points.empty()) return "";
  const Eigen::Vector3d& first = points.front();
  const Eigen::Vector3d& last = points.back();
  return "<g class=\"" + colourClass(trajectory.colour) + "\"><title>" + htmlEscape(trajectory.robot) + "</title>" +
         polyline(usable(trajectory.truth), " class=\"truth\"", view) + polyline(points, "", view) + "<circle cx=\"" +
         svgNumber(view.u(first.x())) + "\" cy=\"" + svgNumber(view.v(first.z())) + "\" r=\"5\"/><rect x=\"" +
         svgNumber(view.u(last.x()) - 4.5) + "\" y=\"" + svgNumber(view.v(last.z()) - 4.5) +
         "\" width=\"9\" height=\"9\"/></g>";
}

}  // namespace

std::string trajectoryPlot(std::span<const ReportTrajectory* const> trajectories) {
  const View view = viewOf(trajectories);
  if (view.height <= 0) return "";
  std::string svg = svgOpen(view.height, "Trajectories from above") + grid(view);
  std::string legend = "<p class=\"legend\">";
  bool has_truth = false;
  for (const ReportTrajectory* trajectory : trajectories) {
    svg += path(*trajectory, view);
    legend += legendEntry(trajectory->colour, trajectory->robot);
    has_truth = has_truth || !trajectory->truth.empty();
  }
  return svg + "</svg>" + legend + "<span class=\"note\">circle: start, square: end; metres" +
         (has_truth ? "; dashed: the truth" : "") + "</span></p>";
}

}  // namespace comap
