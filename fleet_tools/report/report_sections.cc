#include "fleet_tools/report/report_sections.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/report/html.h"
#include "fleet_tools/report/report_table.h"
#include "protocol/types/counted.h"

namespace comap {

using nlohmann::json;

namespace {

std::string card(const std::string& value, const char* label, const char* mood = "") {
  if (value.empty()) return "";
  return "<div class=\"card\"><b class=\"" + std::string(mood) + "\">" + value + "</b><span>" + label +
         "</span></div>\n";
}

std::string withUnit(const std::string& value, const char* unit) { return value.empty() ? "" : value + " " + unit; }

}  // namespace

std::string cards(const json& report) {
  int64_t keyframes = 0, lost = 0;
  bool lost_known = false;
  const std::vector<json> robots = robotRows(report);
  for (const json& robot : robots) {
    const json* count = valueAt(robot, {"keyframes"});
    if (count != nullptr && count->is_number_integer()) keyframes += count->get<int64_t>();
    const json* missing = valueAt(robot, {"keyframes_lost"});
    if (missing != nullptr && missing->is_number_integer()) {
      lost += missing->get<int64_t>();
      lost_known = true;
    }
  }
  const json* maps = valueAt(report, {"maps"});
  const json* merges = valueAt(report, {"merges"});
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
  html +=
      card(withUnit(cellText(valueAt(report, {"joint_ate_rmse_m"}), 1000, 1), "mm"), "joint trajectory error, RMSE");
  html +=
      card(withUnit(cellText(valueAt(report, {"surface", "accuracy_mean_m"}), 1000, 1), "mm"), "mean surface error");
  html += card(withUnit(cellText(valueAt(report, {"surface", "completeness_seen_2cm"}), 100, 1), "%"),
               "of what keyframes saw is mapped");
  html += card(withUnit(cellText(valueAt(report, {"wall_s"}), 1, 1), "s"), "wall time");
  return html + "</div>\n";
}

std::string contradictions(const json& report) {
  constexpr size_t kShown = 8;
  const json* fit = valueAt(report, {"truth_fit"});
  if (fit == nullptr || !fit->is_object()) return "";
  const std::string steps = cellText(valueAt(*fit, {"steps"}));
  if (steps.empty() || steps == "0") return "";
  std::vector<json> rows = arrayRows(*fit, "contradicted");
  rows.resize(std::min(rows.size(), kShown));
  return "<p class=\"sub\">Of " + steps +
         " steps from one keyframe to the next the depth pictures fit the estimate far " + "better than the truth at " +
         cellText(valueAt(*fit, {"estimate_fits_better"})) + ", the truth far better at " +
         cellText(valueAt(*fit, {"truth_fits_better"})) + ".</p>\n" +
         htmlTable({{"from keyframe", {"from"}},
                    {"at, s", {"from_s"}, 1, 2},
                    {"to, s", {"to_s"}, 1, 2},
                    {"sigma at the truth", {"truth_sigma"}, 1, 1},
                    {"at the estimate", {"estimate_sigma"}, 1, 1},
                    {"apart, mm", {"apart_m"}, 1000, 0},
                    {"apart, degrees", {"apart_deg"}, 1, 1}},
                   rows);
}

std::string verdicts(const json& report) {
  struct Row {
    std::string name;
    double count;
    bool good;
  };
  std::vector<Row> rows;
  const json* accepted = valueAt(report, {"verdicts", "accepted"});
  if (accepted != nullptr && accepted->is_number()) rows.push_back({"accepted", accepted->get<double>(), true});
  const json* refused = valueAt(report, {"verdicts", "refused"});
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
  add("core: one keyframe", valueAt(report, {"core", "keyframe_ms"}));
  for (const json& robot : robotRows(report)) {
    add(robot["name"].get<std::string>() + ": odometry, one frame", valueAt(robot, {"odometry_ms"}));
  }
  if (const json* stages = valueAt(report, {"core", "stages_ms"}); stages != nullptr && stages->is_object()) {
    for (const auto& [stage, values] : stages->items()) add("core: " + stage, &values);
  }
  return htmlTable({{"stage", {"name"}}, {"median ms", {"ms", "median"}, 1, 2}, {"95 % ms", {"ms", "p95"}, 1, 2}},
                   rows);
}

std::string parameters(const json& report) {
  std::vector<json> rows;
  const auto add = [&](const std::string& name, const json* value) {
    const std::string text = cellText(value);
    if (!text.empty()) rows.push_back({{"name", name}, {"value", *value}});
  };
  add("version", valueAt(report, {"version"}));
  add("device that was used", valueAt(report, {"core", "device"}));
  add("peak memory of the core, MB", valueAt(report, {"core", "peak_rss_mb"}));
  add("hash of all parameters", valueAt(report, {"parameters_hash"}));
  if (const json* all = valueAt(report, {"parameters"}); all != nullptr && all->is_object()) {
    for (const auto& [name, value] : all->items()) {
      add(name, &value);
      if (!value.is_object()) continue;
      for (const auto& [inner, inner_value] : value.items()) add(name + "." + inner, &inner_value);
    }
  }
  return htmlTable({{"name", {"name"}}, {"value", {"value"}}}, rows);
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

}  // namespace comap
