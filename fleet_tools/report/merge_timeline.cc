#include "fleet_tools/report/merge_timeline.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/report/html.h"
#include "fleet_tools/report/svg.h"

namespace comap {
namespace {

using nlohmann::json;

constexpr double kLeft = 110, kRight = 14, kLane = 30, kTop = 24, kBottom = 24;
constexpr size_t kMaxNameLength = 16;
constexpr double kMaxLength = 1e9;

struct Lane {
  std::string robot;
  double first = 0, last = 0;
  size_t colour = 0;
};

struct Mark {
  double at = 0;
  std::string number;
  std::vector<std::string> robots;
  bool undone = false;
};

std::optional<double> numberOf(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_number()) return std::nullopt;
  const double value = object[key].get<double>();
  return std::isfinite(value) && value >= 0 && value < kMaxLength ? std::optional(value) : std::nullopt;
}

std::vector<Lane> lanesOf(const json& timeline, const std::map<std::string, size_t>& colours) {
  std::vector<Lane> lanes;
  if (!timeline.contains("robots") || !timeline["robots"].is_object()) return lanes;
  for (const auto& [robot, span] : timeline["robots"].items()) {
    const auto first = numberOf(span, "first"), last = numberOf(span, "last");
    if (!first || !last || *last < *first) continue;
    const auto colour = colours.find(robot);
    lanes.push_back({robot, *first, *last, colour == colours.end() ? lanes.size() : colour->second});
  }
  std::stable_sort(lanes.begin(), lanes.end(), [](const Lane& a, const Lane& b) { return a.first < b.first; });
  return lanes;
}

std::vector<Mark> marksOf(const json& report) {
  std::vector<Mark> marks;
  if (!report.contains("merges") || !report["merges"].is_array()) return marks;
  for (const json& merge : report["merges"]) {
    const auto keyframe = numberOf(merge, "keyframes_ingested"), tick = numberOf(merge, "tick");
    if (!keyframe && !tick) continue;
    Mark mark{keyframe ? *keyframe : *tick, "", {}, false};
    if (const auto number = numberOf(merge, "number")) mark.number = fixed(*number, 0);
    if (merge.contains("robots") && merge["robots"].is_array())
      for (const json& robot : merge["robots"])
        if (robot.is_string()) mark.robots.push_back(robot.get<std::string>());
    mark.undone = merge.contains("undone") && merge["undone"].is_string() && merge["undone"] != "";
    marks.push_back(std::move(mark));
  }
  return marks;
}

}  // namespace

std::string mergeTimeline(const json& report, const std::map<std::string, size_t>& colours) {
  if (!report.is_object() || !report.contains("timeline") || !report["timeline"].is_object()) return "";
  const json& timeline = report["timeline"];
  const std::vector<Lane> lanes = lanesOf(timeline, colours);
  const std::vector<Mark> marks = marksOf(report);
  if (lanes.empty()) return "";
  double length = 1;
  for (const Lane& lane : lanes) length = std::max(length, lane.last);
  for (const Mark& mark : marks) length = std::max(length, mark.at);
  const double height = kTop + kLane * static_cast<double>(lanes.size()) + kBottom;
  const auto x = [&](double at) { return kLeft + (kPlotWidth - kLeft - kRight) * at / length; };
  const auto y = [&](size_t lane) { return kTop + kLane * (0.5 + static_cast<double>(lane)); };

  std::string svg = svgOpen(height, "When maps became one") + "<g class=\"grid\">", labels = "<g class=\"axis\">";
  const double step = std::max(1.0, gridStep(length / 8));
  for (double at = 0; at <= length; at += step) {
    svg += svgLine(x(at), kTop, x(at), height - kBottom);
    labels += svgText(x(at), height - 7, "middle", gridNumber(at, step));
  }
  for (size_t i = 0; i < lanes.size(); ++i) {
    const std::string& name = lanes[i].robot;
    labels += svgText(kLeft - 10, y(i) + 4, "end",
                      name.size() > kMaxNameLength ? name.substr(0, kMaxNameLength - 1) + "~" : name);
  }
  svg += "</g>" + labels + "</g>";
  for (size_t i = 0; i < lanes.size(); ++i)
    svg += "<g class=\"" + colourClass(lanes[i].colour) + "\"><title>" + htmlEscape(lanes[i].robot) +
           "</title><polyline style=\"stroke-width:8\" points=\"" + svgNumber(x(lanes[i].first)) + "," +
           svgNumber(y(i)) + " " + svgNumber(x(std::max(lanes[i].last, lanes[i].first + 0.002 * length))) + "," +
           svgNumber(y(i)) + "\"/></g>";
  for (const Mark& mark : marks) {
    std::vector<size_t> joined;
    for (size_t i = 0; i < lanes.size(); ++i)
      if (std::find(mark.robots.begin(), mark.robots.end(), lanes[i].robot) != mark.robots.end()) joined.push_back(i);
    svg += "<g class=\"merge" + std::string(mark.undone ? " undone" : "") + "\">" +
           svgLine(x(mark.at), kTop, x(mark.at), height - kBottom);
    for (const size_t lane : joined)
      svg += "<circle cx=\"" + svgNumber(x(mark.at)) + "\" cy=\"" + svgNumber(y(lane)) + "\" r=\"6\"/>";
    svg += svgText(x(mark.at), kTop - 8, "middle", mark.number) + "</g>";
  }
  const bool frames = timeline.contains("unit") && timeline["unit"] == "frame";
  return "<section class=\"box\">" + svg + "</svg><p class=\"legend\"><span class=\"note\">" +
         (frames ? "frames of each camera that the core had" : "keyframes of all robots that the core had") +
         "; a line: a merge, with its number; dashed: taken back</span></p></section>\n";
}

}  // namespace comap
