#include "fleet_tools/report/run_page.h"

#include <filesystem>

#include "fleet_tools/evaluate/errors_csv.h"
#include "fleet_tools/evaluate/evaluate.h"
#include "fleet_tools/report/map_pictures.h"
#include "fleet_tools/report/report_page.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Errors = std::map<std::string, std::vector<PoseError>>;

bool exists(const std::string& path) {
  std::error_code problem;
  return fs::exists(path, problem);
}

// A robot that never was tracked has a trajectory of no pose, which is a file of no bytes.
bool isEmpty(const std::string& path) {
  std::error_code problem;
  return !fs::exists(path, problem) || fs::file_size(path, problem) == 0;
}

Result<Errors> errorsOf(const std::string& run) {
  const std::string path = run + "/errors.csv";
  return exists(path) ? readErrorsCsv(path) : Errors();
}

Result<std::vector<ReportTrajectory>> trajectoriesOf(const std::string& run, const json& report) {
  const auto errors = errorsOf(run);
  if (!errors) return errors.error();
  std::vector<ReportTrajectory> trajectories;
  for (const auto& [robot, colour] : robotColours(report)) {
    const std::string path = run + "/" + robot + ".trajectory.txt";
    if (isEmpty(path)) continue;
    const auto poses = readTrajectory(path);
    if (!poses) return poses.error();
    ReportTrajectory& trajectory = trajectories.emplace_back();
    trajectory.robot = robot;
    trajectory.colour = colour;
    if (const json& map = report["robots"][robot].value("map", json()); map.is_string()) trajectory.map = map;
    for (const StampedPose& pose : *poses) trajectory.positions.push_back(pose.pose.translation());
    if (const auto known = errors->find(robot); known != errors->end())
      for (const PoseError& pose : known->second) {
        trajectory.truth.push_back(pose.true_position_m);
        trajectory.errors.push_back({1e-9 * static_cast<double>(pose.stamp_ns), pose.error_m});
      }
  }
  return trajectories;
}

}  // namespace

Result<void> writeRunPage(const std::string& run) {
  const auto report = readReport(run);
  if (!report) return report.error();
  const auto trajectories = trajectoriesOf(run, *report);
  if (!trajectories) return trajectories.error();
  const auto pictures = readMapPictures(run);
  if (!pictures) return pictures.error();
  return writeWholeFile(run + "/report.html", renderReportPage(*report, *pictures, *trajectories));
}

}  // namespace comap
