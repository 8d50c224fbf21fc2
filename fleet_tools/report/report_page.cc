#include "fleet_tools/report/report_page.h"

#include <cstdio>
#include <map>

#include "fleet_tools/render/picture_legend.h"
#include "fleet_tools/report/error_plot.h"
#include "fleet_tools/report/html.h"
#include "fleet_tools/report/merge_timeline.h"
#include "fleet_tools/report/report_sections.h"
#include "fleet_tools/report/report_style.h"
#include "fleet_tools/report/report_table.h"
#include "fleet_tools/report/svg.h"
#include "fleet_tools/report/trajectory_plot.h"

namespace comap {
namespace {

using nlohmann::json;

std::string headed(const char* title, const std::string& body) {
  return body.empty() ? "" : std::string("<h2>") + title + "</h2>\n" + body;
}

std::string plots(const std::vector<ReportTrajectory>& trajectories) {
  std::map<std::string, std::vector<const ReportTrajectory*>> by_map;
  for (const ReportTrajectory& trajectory : trajectories) by_map[trajectory.map].push_back(&trajectory);
  std::string html;
  for (const auto& [map, members] : by_map) {
    const std::string plot = trajectoryPlot(members);
    if (plot.empty()) continue;
    if (by_map.size() > 1) html += "<h3>map " + htmlEscape(map) + "</h3>\n";
    html += "<section class=\"box\">" + plot + "</section>\n";
  }
  return html;
}

std::string errors(const std::vector<ReportTrajectory>& trajectories) {
  const std::string plot = errorPlot(trajectories);
  return plot.empty() ? "" : "<section class=\"box\">" + plot + "</section>\n";
}

}  // namespace

std::map<std::string, size_t> robotColours(const json& report) {
  std::map<std::string, size_t> colours;
  for (const json& robot : robotRows(report)) {
    const json* colour = valueAt(robot, {"colour"});
    const bool told = colour != nullptr && colour->is_number_integer() && *colour >= 0;
    colours[robot["name"].get<std::string>()] = told ? colour->get<size_t>() : colours.size();
  }
  return colours;
}

std::string pictureGallery(const std::vector<ReportPicture>& pictures, const std::map<std::string, size_t>& robots,
                           const std::string& layout) {
  if (pictures.empty()) return "";
  std::string html = "<div class=\"" + layout + "\">\n";
  for (const ReportPicture& picture : pictures) {
    if (picture.png.empty()) continue;
    const std::string title = htmlEscape(picture.title);
    html += "<figure><img alt=\"" + title + "\" src=\"data:image/png;base64," + base64(picture.png) +
            "\"><figcaption>" + title;
    const auto& colours = picture.colours.empty() ? robots : picture.colours;
    std::string legend;
    for (const auto& [name, colour] : colours) legend += legendEntry(colour, name);
    if (picture.by_robot && colours.size() > 1)
      html += "<span class=\"legend\">" + legend + "<span class=\"note\">mixed: seen by several</span></span>";
    html += "</figcaption></figure>\n";
  }
  return html + "</div>\n";
}

std::string pageHead(const std::string& title) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      htmlEscape(title) + "</title>\n<style>" + kReportStyle;
  for (size_t i = 0; i < 8; ++i) {
    const Rgb c = robotColour(i);
    char rule[64];
    std::snprintf(rule, sizeof rule, ".c%zu{color:#%02x%02x%02x}", i, c.r, c.g, c.b);
    html += rule;
  }
  return html + "</style>\n</head>\n<body>\n<main>\n<h1>" + htmlEscape(title) + "</h1>\n";
}

std::string renderReportPage(const json& report, const std::vector<ReportPicture>& pictures,
                             const std::vector<ReportTrajectory>& trajectories) {
  const std::vector<Column> robot_columns = {{"robot", {"name"}},
                                             {"map", {"map"}},
                                             {"frames", {"frames"}},
                                             {"keyframes", {"keyframes"}},
                                             {"lost keyframes", {"keyframes_lost"}},
                                             {"frames without tracking", {"tracking_lost_frames"}},
                                             {"sent, MB", {"uplink_bytes"}, 1e-6, 1},
                                             {"sent, kB/s", {"uplink_bytes_per_s"}, 1e-3, 0},
                                             {"received, MB", {"downlink_bytes"}, 1e-6, 1},
                                             {"own error, mm", {"ate_rmse_m"}, 1000, 1},
                                             {"joint error, mm", {"joint_ate_rmse_m"}, 1000, 1},
                                             {"drift in 1 s, mm", {"rpe_1s", "translation_rmse_m"}, 1000, 1},
                                             {"turn in 1 s, degrees", {"rpe_1s", "rotation_rmse_deg"}, 1, 3}};
  const std::vector<Column> map_columns = {{"map", {"id"}},
                                           {"robots", {"robots"}},
                                           {"keyframes", {"keyframes"}},
                                           {"tiles", {"tiles"}},
                                           {"surfels", {"surfels"}}};
  const std::vector<Column> merge_columns = {{"merge", {"number"}},
                                             {"kept", {"kept"}},
                                             {"absorbed", {"absorbed"}},
                                             {"robots", {"robots"}},
                                             {"votes", {"voters"}, 1, -1, true},
                                             {"at keyframe", {"keyframes_ingested"}},
                                             {"at frame", {"tick"}},
                                             {"taken back", {"undone"}}};
  const std::vector<Column> surface_columns = {{"mean, mm", {"accuracy_mean_m"}, 1000, 2},
                                               {"median, mm", {"accuracy_median_m"}, 1000, 2},
                                               {"90 % nearer than, mm", {"accuracy_p90_m"}, 1000, 2},
                                               {"complete to 2 cm, %", {"completeness_2cm"}, 100, 1},
                                               {"of what was seen, %", {"completeness_seen_2cm"}, 100, 1},
                                               {"double walls, %", {"double_surface"}, 100, 2}};
  const std::vector<Column> closure_columns = {{"accepted between robots", {"accepted"}},
                                               {"right", {"right"}},
                                               {"precision", {"precision"}, 1, 3},
                                               {"keyframe recall", {"keyframe_recall"}, 1, 3},
                                               {"pair recall", {"pair_recall"}, 1, 3},
                                               {"false merges", {"false_merges"}},
                                               {"still standing", {"false_merges_standing"}},
                                               {"first right merge, s", {"first_merge_s"}, 1, 1}};
  std::vector<json> closures;
  if (const json* values = valueAt(report, {"closures"}); values != nullptr && values->is_object())
    closures.push_back(*values);
  std::vector<json> surface;
  json of_surface = json::object();
  if (const json* values = valueAt(report, {"surface"}); values != nullptr && values->is_object()) of_surface = *values;
  if (const json* doubles = valueAt(report, {"double_surface"})) of_surface["double_surface"] = *doubles;
  if (!of_surface.empty()) surface.push_back(std::move(of_surface));

  const std::map<std::string, size_t> colours = robotColours(report);
  std::string page = pageHead("CoMap report") + "<p class=\"sub\">";
  const std::string version = cellText(valueAt(report, {"version"})),
                    device = cellText(valueAt(report, {"core", "device"}));
  page += "What the robots saw, how their maps became one, and what it cost.";
  if (!version.empty()) page += " Version " + version + (device.empty() ? "." : ", on " + device + ".");
  page += "</p>\n" + cards(report);
  page += headed("Pictures", pictureGallery(pictures, colours));
  page += headed("Trajectories from above", plots(trajectories));
  page += headed(valueAt(report, {"joint_ate_rmse_m"}) != nullptr ? "Error over time, all robots aligned together"
                                                                  : "Error over time, each robot aligned by itself",
                 errors(trajectories));
  page += headed("When maps became one", mergeTimeline(report, colours));
  page += headed("Robots", htmlTable(robot_columns, robotRows(report)));
  page += headed("Maps", htmlTable(map_columns, arrayRows(report, "maps")));
  page += headed("Merges", htmlTable(merge_columns, arrayRows(report, "merges")));
  page += headed("Place matches", verdicts(report));
  page += headed("Place matches against the truth", htmlTable(closure_columns, closures));
  page += headed("The truth against the depth pictures", contradictions(report));
  page += headed("Surface", htmlTable(surface_columns, surface));
  page += headed("Timings", timings(report));
  page += headed("Parameters", parameters(report));
  page += rawReport(report);
  return page + "</main>\n</body>\n</html>\n";
}

}  // namespace comap
