#include "tests/benchmarks/odometry/race.h"

#include <algorithm>
#include <filesystem>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/evaluate/metrics.h"

namespace comap {
namespace {

struct Runner {
  std::unique_ptr<Method> method;
  Row row;
  std::vector<StampedPose> poses;
};

void take(Runner& runner, const Frame& frame, size_t index, const StepTold& told) {
  const Step step = runner.method->step(frame);
  Row& row = runner.row;
  ++row.frames;
  row.keyframes += step.keyframe;
  row.poor += step.state == TrackingState::kPoor;
  row.lost += step.state == TrackingState::kLost;
  row.cpu_ms.push_back(step.cpu_ms);
  row.wall_ms.push_back(step.wall_ms);
  runner.poses.push_back({frame.stamp_ns, step.T_odom_cam});
  told(index, *runner.method, step);
}

Result<void> score(Runner& runner, const std::vector<StampedPose>& truth) {
  constexpr double kStretch_m = 1;
  const auto pairs = associate(runner.poses, truth);
  const auto ate = absoluteError(pairs);
  if (!ate)
    return Error{ErrorCode::kProblem, runner.row.sequence + ": only " + std::to_string(pairs.size()) + " of " +
                                          std::to_string(runner.poses.size()) +
                                          " frames have a true pose; at least 3 are needed"};
  runner.row.pairs = pairs.size();
  runner.row.ate_rmse_m = ate->rmse_m;
  runner.row.path_m = pathLength_m(pairs);
  runner.row.relative = relativeErrorOverSecond(pairs);
  runner.row.drift_percent = driftPercent(pairs, kStretch_m);
  return {};
}

std::string nameOf(const TumPlace& place, const std::string& text) {
  const std::filesystem::path folder = std::filesystem::path(place.directory).lexically_normal();
  const std::string last = folder.filename().empty() ? folder.parent_path().filename() : folder.filename();
  const std::string before = (folder.filename().empty() ? folder.parent_path() : folder).parent_path().filename();
  const size_t range = text.size() > place.directory.size() ? text.rfind('@') : std::string::npos;
  return (before.empty() ? last : before + "/" + last) + (range == std::string::npos ? "" : text.substr(range));
}

}  // namespace

Result<std::vector<Row>> race(const std::string& place, const MethodsFor& methods_for, const StepTold& told) {
  const auto folder = parseTumPlace(place);
  if (!folder) return folder.error();
  auto source = openSource(place);
  if (!source) return source.error();
  const auto truth = readTrajectory(folder->directory + "/groundtruth.txt");
  if (!truth) return truth.error();

  std::vector<Runner> runners;
  for (size_t index = 0;; ++index) {
    auto next = (*source)->next();
    if (!next) return next.error();
    if (!*next) break;
    const Frame& frame = **next;
    if (runners.empty()) {
      for (auto& method : methods_for(frame.camera)) {
        Row row;
        row.sequence = nameOf(*folder, place);
        row.method = method->name();
        runners.push_back({std::move(method), std::move(row), {}});
      }
    }
    // Each goes first in turn: who comes later finds the frame in the processor's cache.
    for (size_t i = 0; i < runners.size(); ++i) take(runners[(i + index) % runners.size()], frame, index, told);
  }
  std::vector<Row> rows;
  for (Runner& runner : runners) {
    if (auto scored = score(runner, *truth); !scored) return scored.error();
    rows.push_back(std::move(runner.row));
  }
  return rows;
}

}  // namespace comap
