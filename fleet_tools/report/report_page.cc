#include "fleet_tools/report/report_page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/render/picture_legend.h"
#include "fleet_tools/report/error_plot.h"
#include "fleet_tools/report/html.h"
#include "fleet_tools/report/merge_timeline.h"
#include "fleet_tools/report/report_style.h"
#include "fleet_tools/report/svg.h"
#include "fleet_tools/report/trajectory_plot.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

using nlohmann::json;

const json* find(const json& from, std::initializer_list<const char*> path) {
  const json* at = &from;
  for (const char* key : path) {
    if (!at->is_object()) return nullptr;
    const auto found = at->find(key);
    if (found == at->end() || found->is_null()) return nullptr;
    at = &*found;
  }
  return at;
}

// Escaped text of a value; numbers scaled and with so many decimals. Empty for null and for what has no one-line form.
std::string cell(const json* value, double scale = 1, int decimals = -1) {
  if (value == nullptr || value->is_null()) return "";
  if (value->is_string()) return htmlEscape(value->get<std::string>());
  if (value->is_boolean()) return value->get<bool>() ? "yes" : "no";
  if (value->is_number() && (decimals >= 0 || value->is_number_float())) {
    return fixed(scale * value->get<double>(), decimals >= 0 ? decimals : 4);
  }
  if (value->is_number()) return value->dump();
  if (value->is_array()) {
    std::string text;
    for (const json& item : *value) text += (text.empty() ? "" : ", ") + cell(&item);
    return text;
  }
  return "";
}

struct Column {
  std::string title;
  std::vector<std::string> path;
  double scale = 1;
  int decimals = -1;
  bool count = false;  // of an array: how many
};

std::string columnText(const json& row, const Column& column) {
  const json* at = &row;
  for (const std::string& key : column.path) at = at == nullptr ? nullptr : find(*at, {key.c_str()});
  if (column.count && at != nullptr && at->is_array()) return std::to_string(at->size());
  return cell(at, column.scale, column.decimals);
}

bool looksNumeric(const std::string& text) { return text.find_first_not_of("0123456789.-+e") == std::string::npos; }

// Columns that no row has are left out.
std::string table(const std::vector<Column>& columns, const std::vector<json>& rows) {
  if (rows.empty()) return "";
  std::vector<std::vector<std::string>> texts;
  std::vector<bool> used(columns.size(), false), numeric(columns.size(), true);
  for (const json& row : rows) {
    std::vector<std::string>& line = texts.emplace_back();
    for (size_t c = 0; c < columns.size(); ++c) {
      line.push_back(columnText(row, columns[c]));
      used[c] = used[c] || !line.back().empty();
      numeric[c] = numeric[c] && looksNumeric(line.back());
    }
  }
  if (std::none_of(used.begin(), used.end(), [](bool any) { return any; })) return "";
  std::string html = "<section class=\"box\"><table><thead><tr>";
  for (size_t c = 0; c < columns.size(); ++c) {
    if (used[c]) html += (numeric[c] ? "<th class=\"n\">" : "<th>") + columns[c].title + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const auto& line : texts) {
    html += "<tr>";
    for (size_t c = 0; c < columns.size(); ++c) {
      if (used[c]) html += (numeric[c] ? "<td class=\"n\">" : "<td class=\"w\">") + line[c] + "</td>";
    }
    html += "</tr>";
  }
  return html + "</tbody></table></section>\n";
}

std::string headed(const char* title, const std::string& body) {
  return body.empty() ? "" : std::string("<h2>") + title + "</h2>\n" + body;
}

std::string card(const std::string& value, const char* label, const char* mood = "") {
  if (value.empty()) return "";
  return "<div class=\"card\"><b class=\"" + std::string(mood) + "\">" + value + "</b><span>" + label +
         "</span></div>\n";
}

std::string withUnit(const std::string& value, const char* unit) { return value.empty() ? "" : value + " " + unit; }

// Robots as rows that know their own name.
std::vector<json> robotRows(const json& report) {
  std::vector<json> rows;
  const json* robots = find(report, {"robots"});
  if (robots == nullptr || !robots->is_object()) return rows;
  for (const auto& [name, values] : robots->items()) {
    if (!values.is_object()) continue;
    json row = values;
    row["name"] = name;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<json> arrayRows(const json& report, const char* key) {
  const json* list = find(report, {key});
  if (list == nullptr || !list->is_array()) return {};
  return {list->begin(), list->end()};
}

// Where the depth pictures contradict the truth, the worst first: there an error says as much about the truth.
std::string contradictions(const json& report) {
  constexpr size_t kShown = 8;
  const json* fit = find(report, {"truth_fit"});
  if (fit == nullptr || !fit->is_object()) return "";
  const std::string steps = cell(find(*fit, {"steps"}));
  if (steps.empty() || steps == "0") return "";
  std::vector<json> rows = arrayRows(*fit, "contradicted");
  rows.resize(std::min(rows.size(), kShown));
  return "<p class=\"sub\">Of " + steps +
         " steps from one keyframe to the next the depth pictures fit the estimate far " + "better than the truth at " +
         cell(find(*fit, {"estimate_fits_better"})) + ", the truth far better at " +
         cell(find(*fit, {"truth_fits_better"})) + ".</p>\n" +
         table({{"from keyframe", {"from"}},
                {"at, s", {"from_s"}, 1, 2},
                {"to, s", {"to_s"}, 1, 2},
                {"sigma at the truth", {"truth_sigma"}, 1, 1},
                {"at the estimate", {"estimate_sigma"}, 1, 1},
                {"apart, mm", {"apart_m"}, 1000, 0},
                {"apart, degrees", {"apart_deg"}, 1, 1}},
               rows);
}

std::string cards(const json& report) {
  int64_t keyframes = 0, lost = 0;
  bool lost_known = false;
  const std::vector<json> robots = robotRows(report);
  for (const json& robot : robots) {
    const json* count = find(robot, {"keyframes"});
    if (count != nullptr && count->is_number_integer()) keyframes += count->get<int64_t>();
    const json* missing = find(robot, {"keyframes_lost"});
    if (missing != nullptr && missing->is_number_integer()) {
      lost += missing->get<int64_t>();
      lost_known = true;
    }
  }
  const json* maps = find(report, {"maps"});
  const json* merges = find(report, {"merges"});
  std::string html = "<div class=\"cards\">\n";
  if (!robots.empty()) html += card(std::to_string(robots.size()), wordFor(robots.size(), "robot", "robots"));
  if (maps != nullptr && maps->is_array()) {
    const char* words = wordFor(maps->size(), "map at the end", "maps at the end");
    html += card(std::to_string(maps->size()), words, maps->size() == 1 && robots.size() > 1 ? "good" : "");
  }
  if (merges != nullptr && merges->is_array())
    html += card(std::to_string(merges->size()), wordFor(merges->size(), "merge", "merges"));
  if (!robots.empty()) html += card(std::to_string(keyframes), "keyframes");
  if (lost_known) html += card(std::to_string(lost), "keyframes lost", lost == 0 ? "good" : "bad");
  html += card(withUnit(cell(find(report, {"joint_ate_rmse_m"}), 1000, 1), "mm"), "joint trajectory error, RMSE");
  html += card(withUnit(cell(find(report, {"surface", "accuracy_mean_m"}), 1000, 1), "mm"), "mean surface error");
  html += card(withUnit(cell(find(report, {"surface", "completeness_2cm"}), 100, 1), "%"), "surface seen, within 2 cm");
  html += card(withUnit(cell(find(report, {"wall_s"}), 1, 1), "s"), "wall time");
  return html + "</div>\n";
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

std::string verdicts(const json& report) {
  struct Row {
    std::string name;
    double count;
    bool good;
  };
  std::vector<Row> rows;
  const json* accepted = find(report, {"verdicts", "accepted"});
  if (accepted != nullptr && accepted->is_number()) rows.push_back({"accepted", accepted->get<double>(), true});
  const json* refused = find(report, {"verdicts", "refused"});
  if (refused != nullptr && refused->is_object()) {
    for (const auto& [reason, count] : refused->items()) {
      if (count.is_number()) rows.push_back({"refused: " + reason, count.get<double>(), false});
    }
  }
  if (rows.empty()) return "";
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return std::pair(a.good, a.count) > std::pair(b.good, b.count); });
  double most = 1;
  for (const Row& row : rows) most = std::max(most, row.count);
  std::string html = "<section class=\"box\"><table><tbody>";
  for (const Row& row : rows) {
    html += "<tr><td class=\"w\">" + htmlEscape(row.name) + "</td><td class=\"n\">" + fixed(row.count, 0) +
            "</td><td style=\"width:55%\"><div class=\"bar" + (row.good ? " ok" : "") +
            "\" style=\"width:" + fixed(std::clamp(100 * row.count / most, 0.0, 100.0), 1) + "%\"></div></td></tr>";
  }
  return html + "</tbody></table></section>\n";
}

std::string timings(const json& report) {
  std::vector<json> rows;
  const auto add = [&](const std::string& name, const json* values) {
    if (values != nullptr && values->is_object()) rows.push_back({{"name", name}, {"ms", *values}});
  };
  add("core: one keyframe", find(report, {"core", "keyframe_ms"}));
  for (const json& robot : robotRows(report)) {
    add(robot["name"].get<std::string>() + ": odometry, one frame", find(robot, {"odometry_ms"}));
  }
  if (const json* stages = find(report, {"core", "stages_ms"}); stages != nullptr && stages->is_object()) {
    for (const auto& [stage, values] : stages->items()) add("core: " + stage, &values);
  }
  return table({{"stage", {"name"}}, {"median ms", {"ms", "median"}, 1, 2}, {"95 % ms", {"ms", "p95"}, 1, 2}}, rows);
}

// Name and value of what is there; objects one level deep.
std::string parameters(const json& report) {
  std::vector<json> rows;
  const auto add = [&](const std::string& name, const json* value) {
    const std::string text = cell(value);
    if (!text.empty()) rows.push_back({{"name", name}, {"value", *value}});
  };
  add("version", find(report, {"version"}));
  add("device that was used", find(report, {"core", "device"}));
  add("peak memory of the core, MB", find(report, {"core", "peak_rss_mb"}));
  add("hash of all parameters", find(report, {"parameters_hash"}));
  if (const json* all = find(report, {"parameters"}); all != nullptr && all->is_object()) {
    for (const auto& [name, value] : all->items()) {
      add(name, &value);
      if (!value.is_object()) continue;
      for (const auto& [inner, inner_value] : value.items()) add(name + "." + inner, &inner_value);
    }
  }
  return table({{"name", {"name"}}, {"value", {"value"}}}, rows);
}

std::string rawReport(const json& report) {
  std::string escaped;
  const std::string text = report.dump(2, ' ', false, json::error_handler_t::replace);
  for (size_t at = 0; at <= text.size();) {  // line by line: escaping takes line ends for control characters
    const size_t end = std::min(text.find('\n', at), text.size());
    escaped += htmlEscape(text.substr(at, end - at)) + "\n";
    at = end + 1;
  }
  return "<details><summary>The report as data</summary><section class=\"box\"><pre>" + escaped +
         "</pre></section></details>\n";
}

}  // namespace

std::map<std::string, size_t> robotColours(const json& report) {
  std::map<std::string, size_t> colours;
  for (const json& robot : robotRows(report)) {
    const json* colour = find(robot, {"colour"});
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
  if (const json* values = find(report, {"closures"}); values != nullptr && values->is_object())
    closures.push_back(*values);
  std::vector<json> surface;
  json of_surface = json::object();
  if (const json* values = find(report, {"surface"}); values != nullptr && values->is_object()) of_surface = *values;
  if (const json* doubles = find(report, {"double_surface"})) of_surface["double_surface"] = *doubles;
  if (!of_surface.empty()) surface.push_back(std::move(of_surface));

  const std::map<std::string, size_t> colours = robotColours(report);
  std::string page = pageHead("CoMap report") + "<p class=\"sub\">";
  const std::string version = cell(find(report, {"version"})), device = cell(find(report, {"core", "device"}));
  page += "What the robots saw, how their maps became one, and what it cost.";
  if (!version.empty()) page += " Version " + version + (device.empty() ? "." : ", on " + device + ".");
  page += "</p>\n" + cards(report);
  page += headed("Pictures", pictureGallery(pictures, colours));
  page += headed("Trajectories from above", plots(trajectories));
  page += headed(find(report, {"joint_ate_rmse_m"}) != nullptr ? "Error over time, all robots aligned together"
                                                               : "Error over time, each robot aligned by itself",
                 errors(trajectories));
  page += headed("When maps became one", mergeTimeline(report, colours));
  page += headed("Robots", table(robot_columns, robotRows(report)));
  page += headed("Maps", table(map_columns, arrayRows(report, "maps")));
  page += headed("Merges", table(merge_columns, arrayRows(report, "merges")));
  page += headed("Place matches", verdicts(report));
  page += headed("Place matches against the truth", table(closure_columns, closures));
  page += headed("The truth against the depth pictures", contradictions(report));
  page += headed("Surface", table(surface_columns, surface));
  page += headed("Timings", timings(report));
  page += headed("Parameters", parameters(report));
  page += rawReport(report);
  return page + "</main>\n</body>\n</html>\n";
}

}  // namespace comap
