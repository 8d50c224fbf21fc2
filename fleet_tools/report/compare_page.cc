#include "fleet_tools/report/compare_page.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/report/html.h"
#include "fleet_tools/report/svg.h"

namespace comap {
namespace {

using nlohmann::json;

constexpr double kHeight = 270, kLeft = 50, kRight = 16, kTop = 8, kBottom = 26;

std::string cell(const json& value, double scale, int decimals) {
  return value.is_number() ? fixed(scale * value.get<double>(), decimals) : "";
}

// Why a cell is empty, in few words; all of them are among the notes.
std::string cellOr(const json& value, double scale, int decimals, const json& numbers, const char* reason) {
  if (value.is_number() || !numbers.at(reason).is_string()) return cell(value, scale, decimals);
  const bool apart = numbers.at("maps").is_number() && numbers.at("maps").get<double>() > 1;
  return fmt::format("<span title=\"{}\">{}</span>", htmlEscape(numbers.at(reason).get<std::string>()),
                     apart ? cell(numbers.at("maps"), 1, 0) + " maps" : "none");
}

std::string row(const std::vector<std::string>& cells, const char* tag) {
  std::string html = "<tr>";
  for (size_t i = 0; i < cells.size(); ++i)
    html += fmt::format("<{0} class=\"{1}\">{2}</{0}>", tag, i < 2 ? "m" : "n", cells[i]);
  return html + "</tr>";
}

std::string lostText(const json& numbers) {
  double lost = 0;
  bool known = false;
  for (const auto& [robot, count] : numbers.at("lost_frames").items()) {
    if (!count.is_number()) continue;
    known = true;
    lost += count.get<double>();
  }
  return known ? fixed(lost, 0) : "";
}

// As the paper has it: errors of trajectories and surface, one line for each set of cameras.
std::string errors(const json& comparison) {
  std::vector<std::string> robots;
  for (const json& input : comparison.at("inputs"))
    for (const auto& [robot, ate] : input.at("paper").at("ate_rmse_m").items())
      if (std::find(robots.begin(), robots.end(), robot) == robots.end()) robots.push_back(robot);
  std::vector<std::string> head = {"cameras", "mode"};
  for (const std::string& robot : robots) head.push_back(fmt::format("ATE {}, m", htmlEscape(robot)));
  for (const char* title :
       {"joint ATE, m", "surface, m", "doubles, %", "maps", "false merges", "poses/frames", "frames lost"})
    head.push_back(title);
  std::string html = "<section class=\"box\"><table><thead>" + row(head, "th") + "</thead><tbody>";
  for (const json& input : comparison.at("inputs"))
    for (const auto& [mode, n] : rowsOf(input)) {
      std::vector<std::string> cells = {htmlEscape(input.at("name").get<std::string>()), mode};
      for (const std::string& robot : robots) cells.push_back(cell(n["ate_rmse_m"].value(robot, json()), 1, 4));
      cells.insert(cells.end(),
                   {cellOr(n["joint_ate_rmse_m"], 1, 4, n, "joint_ate_reason"),
                    cellOr(n["surface_mean_m"], 1, 4, n, "surface_reason"), cell(n["double_surface"], 100, 2),
                    cell(n["maps"], 1, 0), cell(n["false_merges"], 1, 0), htmlEscape(framesText(n)), lostText(n)});
      html += row(cells, "td");
    }
  return html + "</tbody></table></section>\n";
}

std::string costs(const json& comparison) {
  std::string html = "<section class=\"box\"><table><thead>" +
                     row({"cameras", "mode", "frames", "MB sent", "kB a frame", "ms a frame, all", "core ms, median",
                          "core ms, 95 %", "core ms, worst"},
                         "th") +
                     "</thead><tbody>";
  for (const json& input : comparison.at("inputs"))
    for (const auto& [mode, n] : rowsOf(input)) {
      const json& core = n["core_frame_ms"].is_object() ? n["core_frame_ms"] : n["core_keyframe_ms"];
      const auto of = [&](const char* key) { return core.is_object() ? core.value(key, json()) : json(); };
      html += row({htmlEscape(input.at("name").get<std::string>()), mode, cell(n["frames"], 1, 0),
                   cell(n["uplink_bytes"], 1e-6, 1), cell(n["uplink_bytes_per_frame"], 1e-3, 1),
                   cell(n["wall_ms_per_frame"], 1, 0), cell(of("median"), 1, 0), cell(of("p95"), 1, 0),
                   cell(of("worst"), 1, 0)},
                  "td");
    }
  return html +
         "</tbody></table></section>\n<p class=\"sub\">Of the graph mode the core's times are for a keyframe, of "
         "the paper mode for a frame of one camera. \"All\" is the whole run's wall time, robots included.</p>\n";
}

std::string words(const json& comparison) {
  const json& accurate = comparison.at("at_least_as_accurate");
  const auto card = [](const std::string& value, const char* label) {
    return fmt::format("<div class=\"card\"><b class=\"{}\">{}</b><span>{}</span></div>\n",
                       value == "yes"  ? "good"
                       : value == "no" ? "bad"
                                       : "",
                       value, label);
  };
  std::string html = "<div class=\"cards\">\n";
  html += card(accurate.is_null()     ? "?"
               : accurate.get<bool>() ? "yes"
                                      : "no",
               accurate.is_null() ? "whether the graph mode is as accurate is not known"
                                  : "the graph mode is at least as accurate in each row");
  if (accurate.is_null()) html += card("", htmlEscape(comparison.at("not_known_because").get<std::string>()).c_str());
  html += card(comparison.at("a_tenth_of_the_bytes").get<bool>() ? "yes" : "no",
               "the graph mode sends at most a tenth of the bytes");
  html += "</div>\n";
  for (const auto& [key, title] : {std::pair("not_so", "Where it is not so"), std::pair("notes", "To be known")}) {
    if (comparison.at(key).empty()) continue;
    html += fmt::format("<h2>{}</h2>\n<section class=\"box\"><table><tbody>", title);
    for (const json& word : comparison.at(key))
      html += "<tr><td class=\"w\">" + htmlEscape(word.get<std::string>()) + "</td></tr>";
    html += "</tbody></table></section>\n";
  }
  return html;
}

// Median time of a frame of one camera and of a round of all, over how many cameras took part; sets of one size
// averaged.
std::string timesOverCameras(const json& comparison) {
  struct Sum {
    double frame_ms = 0, round_ms = 0, sets = 0;
  };
  std::map<size_t, Sum> sums;
  for (const json& input : comparison.at("inputs")) {
    const json& paper = input.at("paper");
    if (!paper["core_frame_ms"].is_object() || !paper["round_ms"].is_object()) continue;
    Sum& sum = sums[paper["ate_rmse_m"].size()];
    sum.frame_ms += paper["core_frame_ms"].value("median", 0.0);
    sum.round_ms += paper["round_ms"].value("median", 0.0);
    ++sum.sets;
  }
  if (sums.empty()) return "";
  double most = 1;
  for (const auto& [cameras, sum] : sums) most = std::max(most, sum.round_ms / sum.sets);
  std::string html = "<section class=\"box\"><table><thead>" +
                     row({"cameras", "", "sets", "ms a frame of one camera", "ms a round of all"}, "th") +
                     "</thead><tbody>";
  for (const auto& [cameras, sum] : sums) {
    const double round_ms = sum.round_ms / sum.sets, frame_ms = sum.frame_ms / sum.sets;
    const std::string bars = fmt::format(
        "<svg width=\"420\" height=\"26\" role=\"img\" aria-label=\"Time of a round and of a frame\"><g class=\"c0\">"
        "<rect x=\"0\" y=\"2\" width=\"{:.1f}\" height=\"10\" fill=\"currentColor\"/></g><g class=\"c1\"><rect x=\"0\" "
        "y=\"14\" width=\"{:.1f}\" height=\"10\" fill=\"currentColor\"/></g></svg>",
        420 * round_ms / most, 420 * frame_ms / most);
    html += row({std::to_string(cameras), bars, fixed(sum.sets, 0), fixed(frame_ms, 0), fixed(round_ms, 0)}, "td");
  }
  return html +
         "</tbody></table><p class=\"legend\"><span class=\"c0\"><i></i>a round of all cameras</span><span "
         "class=\"c1\"><i></i>a frame of one camera</span><span class=\"note\">wall time on this machine, "
         "with whatever else it was doing</span></p></section>\n";
}

// Time of each frame of each camera on top of each other, by tick; merges as marks.
std::string timePlot(const RoundTimes& times) {
  if (times.ms.size() < 2) return "";
  const size_t cameras = times.cameras.size();
  std::vector<std::vector<double>> sums(cameras, std::vector<double>(times.ms.size(), 0.0));
  double most = 1;
  for (size_t tick = 0; tick < times.ms.size(); ++tick) {
    double sum = 0;
    for (size_t c = 0; c < cameras; ++c) {
      if (c < times.ms[tick].size()) sum += times.ms[tick][c];
      sums[c][tick] = sum;
    }
    most = std::max(most, sum);
  }
  most *= 1.05;
  const double last = static_cast<double>(times.ms.size() - 1);
  const auto x = [&](double tick) { return kLeft + (kPlotWidth - kLeft - kRight) * (tick - 1) / last; };
  const auto y = [&](double ms) { return kTop + (kHeight - kTop - kBottom) * (1 - ms / most); };
  std::string svg = svgOpen(kHeight, "Time of each round") + "<g class=\"grid\">", labels = "<g class=\"axis\">";
  const double up = gridStep(most / 4), across = std::max(1.0, gridStep(last / 8));
  for (double ms = 0; ms <= most; ms += up) {
    svg += svgLine(kLeft, y(ms), kPlotWidth - kRight, y(ms));
    labels += svgText(kLeft - 6, y(ms) + 4, "end", gridNumber(ms, up));
  }
  for (double tick = across; tick <= last + 1; tick += across)
    labels += svgText(x(tick), kHeight - 7, "middle", gridNumber(tick, across));
  svg += "</g>" + labels + "</g>";
  for (const size_t tick : times.merges) {
    const double at = x(static_cast<double>(tick));
    svg += "<g class=\"merge\" stroke-dasharray=\"4 4\">" + svgLine(at, kTop, at, kHeight - kBottom) + "</g>";
  }
  std::string legend = "<p class=\"legend\">";
  for (size_t c = 0; c < cameras; ++c) {
    std::string points;
    for (size_t tick = 0; tick < sums[c].size(); ++tick)
      points += svgNumber(x(static_cast<double>(tick + 1))) + "," + svgNumber(y(sums[c][tick])) + " ";
    svg +=
        fmt::format("<g class=\"{}\"><polyline style=\"stroke-width:1.2\" points=\"{}\"/></g>", colourClass(c), points);
    legend += legendEntry(c, (c == 0 ? "" : "with ") + times.cameras[c]);
  }
  return "<section class=\"box\">" + svg + "</svg>" + legend +
         "<span class=\"note\">milliseconds a round, one camera after the other, by tick; dashed: a "
         "merge</span></p></section>\n";
}

}  // namespace

std::string comparePage(const json& comparison, const std::vector<ReportPicture>& pictures, const RoundTimes& times) {
  std::string page = pageHead("Graph mode and paper mode") + "<p class=\"sub\">The same recordings, ";
  page += "once as keyframes into a graph, once as every frame into the method of \"Collaborative Dense SLAM\".</p>\n";
  page += words(comparison) + "<h2>Accuracy</h2>\n" + errors(comparison);
  page += "<h2>Cost</h2>\n" + costs(comparison);
  if (const std::string bars = timesOverCameras(comparison); !bars.empty())
    page += "<h2>Time over the number of cameras in the paper mode, medians</h2>\n" + bars;
  if (const std::string plot = timePlot(times); !plot.empty())
    page += "<h2>Time of each round in the paper mode</h2>\n" + plot;
  std::map<std::string, size_t> robots;
  for (const std::string& camera : times.cameras) robots.emplace(camera, robots.size());
  if (!pictures.empty())
    page += "<h2>Maps, and who contributed what</h2>\n" + pictureGallery(pictures, robots, "pairs");
  return page + "</main>\n</body>\n</html>\n";
}

}  // namespace comap
