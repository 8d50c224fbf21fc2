#include "fleet_tools/replay/run_summary.h"

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

// What of the robot's frames was not as it should be; empty if all was well.
std::string troubleText(const nlohmann::json& robot) {
  std::string text;
  const auto tell = [&](const char* key, const char* what) {
    const int count = robot.at(key).get<int>();
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  };
  tell("damaged_frames", " damaged and passed over");
  tell("tracking_poor_frames", " tracked poorly");
  tell("tracking_lost_frames", " lost");
  tell("relocalised", " found back");
  return text.empty() ? text : " (" + text + ")";
}

std::string listText(const nlohmann::json& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

// "42 refused (31 inlier_ratio, 11 coarse_alignment)", or "none refused".
std::string refusedText(const nlohmann::json& refused) {
  std::vector<std::pair<int, std::string>> reasons;
  int sum = 0;
  for (const auto& [reason, count] : refused.items()) {
    reasons.emplace_back(count.get<int>(), reason);
    sum += count.get<int>();
  }
  if (sum == 0) return "none refused";
  std::stable_sort(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (const auto& [count, reason] : reasons) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  return std::to_string(sum) + " refused (" + text + ")";
}

std::string countOf(const nlohmann::json& object, const char* key, const char* noun) {
  return counted(object.at(key).get<size_t>(), noun);
}

// Of --realtime: a robot that did not keep up; empty if all did.
std::string lateText(const nlohmann::json& robots) {
  std::string text;
  for (const auto& [name, robot] : robots.items())
    if (const double behind_s = robot.value("most_behind_s", 0.0); behind_s >= 1)
      text += (text.empty() ? "" : ", ") + name + " up to " + fixed(behind_s, 1) + " s";
  return text.empty() ? text : "behind the recordings' own speed, this machine being too slow for it: " + text + "\n";
}

size_t framesOf(const nlohmann::json& robot) {
  return robot.at("frames").get<size_t>() + robot.at("damaged_frames").get<size_t>();
}

}  // namespace

void printRunSummary(const nlohmann::json& report, const std::string& out) {
  for (const auto& [name, robot] : report.at("robots").items())
    std::printf("robot %-8s %s%s, %s (%d lost), %.0f kB/s up, odometry %.1f ms (p95 %.1f), map %s, holds %s of it\n",
                name.c_str(), countOf(robot, "frames", "frame").c_str(), troubleText(robot).c_str(),
                countOf(robot, "keyframes", "keyframe").c_str(), robot.at("keyframes_lost").get<int>(),
                robot.at("uplink_bytes_per_s").get<double>() / 1000, robot.at("odometry_ms").at("median").get<double>(),
                robot.at("odometry_ms").at("p95").get<double>(), robot.at("map").get<std::string>().c_str(),
                countOf(robot, "tiles_held", "tile").c_str());
  std::printf("%s", lateText(report.at("robots")).c_str());
  for (const auto& map : report.at("maps"))
    std::printf("map %s: %s %s, %s, %s, %s\n", map.at("id").get<std::string>().c_str(),
                wordFor(map.at("robots").size(), "robot", "robots"), listText(map.at("robots")).c_str(),
                countOf(map, "keyframes", "keyframe").c_str(), countOf(map, "surfels", "surfel").c_str(),
                countOf(map, "tiles", "tile").c_str());
  std::printf("place matches: %d accepted, %s\n", report.at("verdicts").at("accepted").get<int>(),
              refusedText(report.at("verdicts").at("refused")).c_str());
  std::printf("core: %.0f ms a keyframe (p95 %.0f) on %s; %.1f s in all\n",
              report.at("core").at("keyframe_ms").at("median").get<double>(),
              report.at("core").at("keyframe_ms").at("p95").get<double>(),
              report.at("core").at("device").get<std::string>().c_str(), report.at("wall_s").get<double>());
  std::printf("run: %s (map.comap, map.ply, *.trajectory.txt, report.json, report.html)\n", out.c_str());
}

void printPaperSummary(const nlohmann::json& report, const std::string& out) {
  for (const auto& [name, robot] : report.at("robots").items())
    std::printf("robot %-8s %s (%d lost), %.0f kB/s up, map %s\n", name.c_str(),
                countOf(robot, "frames", "frame").c_str(), robot.at("tracking_lost_frames").get<int>(),
                robot.at("uplink_bytes_per_s").get<double>() / 1000, robot.at("map").get<std::string>().c_str());
  for (const auto& map : report.at("maps"))
    std::printf("map %s: %s %s, %s, %s\n", map.at("id").get<std::string>().c_str(),
                wordFor(map.at("robots").size(), "robot", "robots"), listText(map.at("robots")).c_str(),
                countOf(map, "surfels", "surfel").c_str(), countOf(map, "places", "place").c_str());
  const auto& core = report.at("core");
  std::printf("loops: %d local, %d global; merges: %zu\n", core.at("local_loops").get<int>(),
              core.at("global_loops").get<int>(), report.at("merges").size());
  std::printf("core: %.0f ms a frame and camera (p95 %.0f) on %s; %.1f s in all\n",
              core.at("frame_ms").at("median").get<double>(), core.at("frame_ms").at("p95").get<double>(),
              core.at("device").get<std::string>().c_str(), report.at("wall_s").get<double>());
  std::printf("run: %s (map.ply, *.trajectory.txt, frames.csv, report.json, report.html)\n", out.c_str());
}

int failIfIncomplete(const nlohmann::json& report) {
  for (const auto& [name, robot] : report.at("robots").items()) {
    if (robot.at("keyframes_lost").get<int>() > 0)
      return failWith({ErrorCode::kProblem, "robot " + name + ": " +
                                                counted(robot.at("keyframes_lost").get<size_t>(), "keyframe") +
                                                " did not reach the core"});
    if (robot.at("keyframes").get<int>() == 0)
      return failWith({ErrorCode::kBadData, "robot " + name + ": of " + counted(framesOf(robot), "frame") +
                                                " none can be used, " + robot.at("damaged_frames").dump() +
                                                " damaged and the others with too little depth to start from"});
  }
  return 0;
}

}  // namespace comap
