#include "fleet_tools/replay/compare_truth.h"

#include <algorithm>
#include <filesystem>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "fleet_tools/export/ply.h"
#include "mapping_core/surfels/seen_times.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// Where a recorded folder keeps its truth; empty if it has none.
std::string truthBeside(const std::string& source) {
  constexpr const char* kScheme = "tum:";
  const auto place = parseTumPlace(source.starts_with(kScheme) ? source.substr(4) : source);
  if (!place) return "";
  const std::string file = place->directory + "/groundtruth.txt";
  std::error_code none;
  return fs::exists(file, none) ? file : "";
}

}  // namespace

Result<std::map<std::string, std::string>> parseTruths(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> truths;
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
      return Error{ErrorCode::kWrongUse, "--truth " + text + ": expected NAME=FILE"};
    const std::string name = text.substr(0, equals);
    if (!truths.emplace(name, text.substr(equals + 1)).second)
      return Error{ErrorCode::kWrongUse, "--truth " + text + ": robot " + name + " has one already, " + truths[name]};
  }
  return truths;
}

RunTruth truthOf(const std::vector<ReplayRobot>& robots, const RunTruth& given) {
  RunTruth truth;
  truth.surface = given.surface;
  truth.spare_short = true;
  for (const ReplayRobot& robot : robots) {
    const auto known = given.trajectories.find(robot.name);
    const std::string file = known != given.trajectories.end() ? known->second : truthBeside(robot.source);
    if (!file.empty()) truth.trajectories[robot.name] = file;
  }
  return truth;
}

Result<void> checkCompare(const std::vector<ReplayRobot>& robots, const RunTruth& given) {
  if (robots.size() > kMostCameras)
    return Error{ErrorCode::kWrongUse, "--compare: " + std::to_string(robots.size()) +
                                           " robots, the paper mode takes at most " + std::to_string(kMostCameras)};
  for (const auto& [name, file] : given.trajectories)
    if (std::none_of(robots.begin(), robots.end(), [&](const auto& robot) { return robot.name == name; }))
      return Error{ErrorCode::kWrongUse, "--truth " + name + "=" + file + ": there is no robot " + name};
  const RunTruth truth = truthOf(robots, given);
  for (const auto& [name, file] : truth.trajectories) {
    const auto poses = readTrajectory(file);
    if (!poses) return Error{poses.error().code, "truth of robot " + name + ": " + poses.error().text};
    if (poses->empty()) return Error{ErrorCode::kBadData, "truth of robot " + name + ": " + file + ": holds no pose"};
  }
  if (truth.surface.empty()) return {};
  if (truth.trajectories.empty())
    return Error{ErrorCode::kWrongUse,
                 "--surface " + truth.surface + ": nothing to align a map to it by, expected --truth of the robots"};
  const auto surface = readPly(truth.surface);
  if (!surface) return Error{surface.error().code, "--surface: " + surface.error().text};
  if (surface->positions.empty()) return Error{ErrorCode::kBadData, "--surface " + truth.surface + ": holds no point"};
  return {};
}

}  // namespace comap
