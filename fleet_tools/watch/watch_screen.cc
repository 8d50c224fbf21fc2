#include "fleet_tools/watch/watch_screen.h"

#include <algorithm>
#include <sstream>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/store/record_json.h"

namespace comap {
namespace {

constexpr size_t kMergesShown = 6, kVerdictsShown = 8;

void append(std::vector<std::string>& lines, const std::string& text) {
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
}

std::string coreText(const SiteWatch& watch, bool core_there) {
  if (!core_there) return "no core is heard";
  if (!watch.core()) return "core: nothing mapped yet";
  const CoreStatus& core = *watch.core();
  return "core: " + counted(core.keyframes, "keyframe") + ", " + counted(core.maps, "map") + ", " +
         std::to_string(core.queue) + " waiting, " + printable(core.device);
}

std::string robotTable(const SiteWatch& watch, WatchClock::time_point now) {
  TextTable table({"ROBOT", "STATE", "FRAMES", "KEYFRAMES", "SENT", "SENT/s", "WAITING", "WAITING BYTES", "MAP"});
  for (const auto& [name, robot] : watch.robots()) {
    const Status& status = robot.status;
    table.add({printable(name), stateOf(robot, now), std::to_string(status.frames), std::to_string(status.keyframes),
               std::to_string(status.keyframes - std::min(status.keyframes, status.outbox)),
               fixed(deliveredPerSecond(robot, now), 1),
               std::to_string(status.outbox) +
                   (status.keyframes_refused > 0 ? ", " + std::to_string(status.keyframes_refused) + " refused" : ""),
               humanBytes(double(status.outbox_bytes)), robot.correction ? printable(robot.correction->map) : "-"});
  }
  return table.empty() ? std::string("no robots heard yet") : table.text();
}

std::string mergeText(const MergeRecord& merge) {
  std::string robots;
  for (const std::string& robot : merge.robots) robots += (robots.empty() ? "" : ", ") + printable(robot);
  return "merge " + std::to_string(merge.number) + ": " + printable(merge.absorbed) + " into " + printable(merge.kept) +
         " (" + robots + "), " + std::to_string(merge.voters.size()) + " closures" +
         (merge.undone.empty() ? "" : "; undone: " + printable(merge.undone));
}

std::string verdictText(const MatchVerdict& verdict) {
  std::string text = verdict.accepted ? std::string("accepted") : "refused: " + printable(verdict.reason);
  for (const FailedNumber& number : failedNumbers(verdict))
    text += std::string(" (") + number.name + " " + fixed(number.value, 3) + ")";
  return toString(verdict.query) + " - " + toString(verdict.candidate) + "  " + text;
}

size_t mergesThatHold(const SiteWatch& watch) {
  return static_cast<size_t>(std::count_if(watch.merges().begin(), watch.merges().end(),
                                           [](const auto& entry) { return entry.second.undone.empty(); }));
}

}  // namespace

std::vector<std::string> watchScreen(const SiteWatch& watch, const std::string& site, bool core_there,
                                     WatchClock::time_point now) {
  std::vector<std::string> lines = {"site " + printable(site) + "; " + coreText(watch, core_there), ""};
  append(lines, robotTable(watch, now));
  lines.push_back("");
  const size_t hold = mergesThatHold(watch);
  lines.push_back(counted(hold, "merge") + (hold == 1 ? " holds" : " hold"));
  size_t skip = watch.merges().size() - std::min(kMergesShown, watch.merges().size());
  for (const auto& [number, merge] : watch.merges())
    if (skip == 0 || skip-- == 0) lines.push_back("  " + mergeText(merge));
  std::string counts;
  for (const auto& [reason, count] : watch.verdictCounts())
    counts += (counts.empty() ? "" : ", ") + printable(reason) + " " + std::to_string(count);
  lines.push_back("");
  lines.push_back("place matches heard: " + (counts.empty() ? std::string("none") : counts));
  const auto& verdicts = watch.verdicts();
  for (size_t i = verdicts.size() - std::min(kVerdictsShown, verdicts.size()); i < verdicts.size(); ++i)
    lines.push_back("  " + printable(verdictText(verdicts[i])));
  return lines;
}

std::string watchLine(const SiteWatch& watch, bool core_there, WatchClock::time_point now) {
  std::string line = coreText(watch, core_there) + "; merges " + std::to_string(mergesThatHold(watch));
  for (const auto& [name, robot] : watch.robots()) {
    line += "; " + printable(name) + " " + stateOf(robot, now) + " " + std::to_string(robot.status.keyframes) +
            " keyframes " + std::to_string(robot.status.outbox) + " waiting";
  }
  return line;
}

nlohmann::json watchJson(const SiteWatch& watch, const std::string& site, bool core_there, WatchClock::time_point now) {
  nlohmann::json robots = nlohmann::json::object(), merges = nlohmann::json::array(), last = nlohmann::json::array();
  for (const auto& [name, robot] : watch.robots()) {
    const auto pose = robot.T_map_cam();
    robots[name] = {{"state", stateOf(robot, now)},
                    {"frames", robot.status.frames},
                    {"keyframes", robot.status.keyframes},
                    {"waiting", robot.status.outbox},
                    {"waiting_bytes", robot.status.outbox_bytes},
                    {"refused", robot.status.keyframes_refused},
                    {"delivered_per_s", deliveredPerSecond(robot, now)},
                    {"map", robot.correction ? nlohmann::json(robot.correction->map) : nlohmann::json()},
                    {"T_map_cam", pose ? jsonOf(*pose) : nlohmann::json()}};
  }
  for (const auto& [number, merge] : watch.merges()) merges.push_back(jsonOf(merge));
  const auto& verdicts = watch.verdicts();
  for (size_t i = verdicts.size() - std::min(kVerdictsShown, verdicts.size()); i < verdicts.size(); ++i)
    last.push_back(jsonOf(verdicts[i]));
  nlohmann::json json = {{"site", site}, {"core_heard", core_there}, {"robots", robots}, {"merges", merges}};
  json["core"] = !watch.core() ? nlohmann::json()
                               : nlohmann::json{{"keyframes", watch.core()->keyframes},
                                                {"maps", watch.core()->maps},
                                                {"waiting", watch.core()->queue},
                                                {"device", watch.core()->device}};
  json["verdict_counts"] = watch.verdictCounts();
  json["last_verdicts"] = last;
  json["unreadable_messages"] = watch.unreadable();
  return json;
}

}  // namespace comap
