#include "fleet_tools/evaluate/evaluate.h"

#include <filesystem>
#include <fstream>
#include <set>

#include "fleet_tools/evaluate/errors_csv.h"
#include "fleet_tools/evaluate/evaluate_paper.h"
#include "fleet_tools/evaluate/surface_seen.h"
#include "fleet_tools/replay/run_folder.h"
#include "mapping_core/store/map_store.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/types/ids.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr uintmax_t kMaxReport_bytes = uintmax_t{64} << 20;

std::string reportPath(const std::string& run) { return (fs::path(run) / "report.json").string(); }

std::string mapOf(const json& robot) {
  const auto map = robot.find("map");
  return map != robot.end() && map->is_string() ? map->get<std::string>() : "";
}

// Empty if all robots are in one map.
std::string apart(const std::map<std::string, RobotEvaluation>& robots) {
  std::set<std::string> maps;
  std::string list;
  for (const auto& [name, robot] : robots) {
    if (robot.map.empty()) return "robot " + name + " is in no map";
    maps.insert(robot.map);
    list += (list.empty() ? "" : ", ") + name + " in " + robot.map;
  }
  return maps.size() == 1 ? "" : "the robots are in " + std::to_string(maps.size()) + " maps: " + list;
}

// Which points of the true surface the keyframes of the evaluated map have measured; none without a store.
Result<std::vector<uint8_t>> seenByKeyframes(const std::string& run, const MapId& map, const Pose& T_truth_map,
                                             const PlyPoints& surface, int threads) {
  const std::string path = storePathOf(run);
  std::error_code problem;
  if (!fs::exists(path, problem)) return std::vector<uint8_t>();
  auto store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return store.error();
  const auto keyframes = store->keyframes();
  if (!keyframes) return keyframes.error();
  SurfaceSeen seen(surface.positions);
  for (const StoredKeyframe& stored : *keyframes) {
    if (stored.map != map) continue;
    const auto encoded = store->encodedKeyframe(stored.id);
    if (!encoded) return encoded.error();
    const auto keyframe = decodeKeyframe(*encoded);
    if (!keyframe) {
      return Error{keyframe.error().code, path + ": keyframe " + toString(stored.id) + ": " + keyframe.error().text};
    }
    seen.add(keyframe->camera, keyframe->depth, T_truth_map * stored.T_map_cam, threads);
  }
  return seen.seen();
}

Result<void> evaluateSurface(const std::string& run, const RunTruth& truth, int threads, RunEvaluation& evaluation) {
  const std::string path = (fs::path(run) / "map.ply").string();
  std::error_code problem;
  std::optional<PlyPoints> map;
  if (fs::exists(path, problem)) {
    auto read = readPly(path);
    if (!read) return read.error();
    map = std::move(*read);
    if (!map->positions.empty()) evaluation.doubles = findDoubles(*map, threads);
  }
  if (truth.surface.empty()) {
    evaluation.surface_reason = "no true surface given";
    return {};
  }
  auto surface = readPly(truth.surface);
  if (!surface) return surface.error();
  if (surface->positions.empty()) return Error{ErrorCode::kBadData, truth.surface + ": holds no point"};
  if (!evaluation.joint) {
    evaluation.surface_reason = "no alignment: " + evaluation.joint_reason;
    return {};
  }
  if (!map) return Error{ErrorCode::kUnreachable, path + ": does not exist"};
  if (map->positions.empty()) {
    evaluation.surface_reason = "map.ply holds no point";
    return {};
  }
  const Pose& T_truth_map = evaluation.joint->T_truth_estimate;
  const auto seen = seenByKeyframes(run, evaluation.robots.begin()->second.map, T_truth_map, *surface, threads);
  if (!seen) return seen.error();
  evaluation.surface = scoreSurface(*map, T_truth_map, *surface, threads, *seen);
  return {};
}

json toJson(const std::optional<Rpe>& rpe) {
  if (!rpe) return nullptr;
  return {{"translation_rmse_m", rpe->translation_rmse_m},
          {"rotation_rmse_deg", rpe->rotation_rmse_deg},
          {"pairs", rpe->pairs}};
}

}  // namespace

Result<json> readReport(const std::string& run) {
  const std::string path = reportPath(run);
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::error_code problem;
  const auto size = fs::file_size(path, problem);
  if (problem) return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + problem.message()};
  if (size > kMaxReport_bytes) return Error{ErrorCode::kBadData, path + ": is larger than 64 MiB"};
  std::ifstream file(path);
  json report = json::parse(file, nullptr, false);
  if (!report.is_object()) return Error{ErrorCode::kBadData, path + ": is not a JSON object"};
  if (!report.contains("robots") || !report["robots"].is_object()) {
    return Error{ErrorCode::kBadData, path + ": has no object 'robots'"};
  }
  for (const auto& [name, robot] : report["robots"].items()) {
    if (!robot.is_object()) return Error{ErrorCode::kBadData, path + ": robots." + name + " is not an object"};
  }
  return report;
}

Result<TrajectoryEvaluation> evaluateTrajectory(const std::string& trajectory, const std::string& truth) {
  auto estimate = readTrajectory(trajectory);
  if (!estimate) return estimate.error();
  auto reference = readTrajectory(truth);
  if (!reference) return reference.error();
  TrajectoryEvaluation result;
  result.poses = estimate->size();
  result.pairs = associate(*estimate, *reference);
  const auto ate = absoluteError(result.pairs);
  if (!ate) {
    return Error{ErrorCode::kProblem, trajectory + ": only " + std::to_string(result.pairs.size()) + " of " +
                                          std::to_string(estimate->size()) + " poses have a partner within 0.02 s in " +
                                          truth + ", expected 3 or more"};
  }
  result.ate = *ate;
  result.rpe_frame = relativeErrorPerFrame(result.pairs);
  result.rpe_second = relativeErrorPerSecond(result.pairs);
  return result;
}

// As evaluateTrajectory, but what is too short to be measured is told in words.
Result<RobotEvaluation> evaluateRobot(const std::string& trajectory, const std::string& truth, bool spare_short) {
  RobotEvaluation robot;
  std::error_code problem;
  if (spare_short && fs::is_empty(trajectory, problem) && !problem) {
    robot.own_reason = "its trajectory holds no pose";
    return robot;
  }
  auto own = evaluateTrajectory(trajectory, truth);
  if (own) {
    robot.own = std::move(*own);
    return robot;
  }
  if (!spare_short || own.error().code != ErrorCode::kProblem) return own.error();
  auto estimate = readTrajectory(trajectory);
  if (!estimate) return estimate.error();
  auto reference = readTrajectory(truth);
  if (!reference) return reference.error();
  robot.own.poses = estimate->size();
  robot.own.pairs = associate(*estimate, *reference);
  const std::string poses = std::to_string(robot.own.poses);
  if (robot.own.poses < 3)
    robot.own_reason = "its trajectory has " + poses + " poses, 3 are needed";
  else if (robot.own.pairs.empty())
    robot.own_reason = "none of its " + poses + " poses has a time within 0.02 s of one of the truth's";
  else
    robot.own_reason =
        "only " + std::to_string(robot.own.pairs.size()) + " of its " + poses + " poses have a truth, 3 are needed";
  return robot;
}

Result<RunEvaluation> evaluateRun(const std::string& run, const RunTruth& truth, int threads) {
  if (truth.trajectories.empty()) return Error{ErrorCode::kWrongUse, "no truth given, expected NAME=FILE for a robot"};
  auto report = readReport(run);
  if (!report) return report.error();
  const auto& robots = (*report)["robots"];
  RunEvaluation evaluation;
  for (const auto& [name, file] : truth.trajectories) {
    if (const auto problem = robotNameProblem(name); !problem.empty()) return Error{ErrorCode::kWrongUse, problem};
    if (!robots.contains(name)) {
      return Error{ErrorCode::kWrongUse, reportPath(run) + ": knows no robot '" + name + "'"};
    }
    auto robot = evaluateRobot((fs::path(run) / (name + ".trajectory.txt")).string(), file, truth.spare_short);
    if (!robot) return robot.error();
    robot->map = mapOf(robots[name]);
    evaluation.robots[name] = std::move(*robot);
  }
  evaluation.joint_reason = apart(evaluation.robots);
  for (const auto& [name, entry] : robots.items())
    if (!evaluation.robots.contains(name)) evaluation.joint_reason = "no truth given for robot " + name;
  if (evaluation.joint_reason.empty()) {
    std::vector<std::vector<PosePair>> pairs;
    for (const auto& [name, robot] : evaluation.robots) pairs.push_back(robot.own.pairs);
    evaluation.joint = jointError(pairs);
    if (!evaluation.joint) evaluation.joint_reason = "fewer than three poses of all robots have a truth";
    for (auto& [name, robot] : evaluation.robots) {
      if (!evaluation.joint || robot.own.pairs.empty()) continue;
      robot.joint_rmse_m = errorUnder(evaluation.joint->T_truth_estimate, robot.own.pairs).rmse_m;
    }
  }
  if (auto surface = evaluateSurface(run, truth, threads, evaluation); !surface) return surface.error();
  if (const auto mode = report->find("mode"); mode != report->end() && *mode == "paper") {
    auto merges = evaluatePaperMerges(*report, truth.trajectories);
    if (!merges) return Error{merges.error().code, reportPath(run) + ": " + merges.error().text};
    evaluation.closures = *merges;
    return evaluation;
  }
  const std::string store = storePathOf(run);
  std::error_code problem;
  if (!fs::exists(store, problem)) {
    evaluation.closures_reason = "there is no store " + store;
    return evaluation;
  }
  auto closures = evaluateClosures(store, truth.trajectories);
  if (!closures) return closures.error();
  evaluation.closures = *closures;
  auto fit = fitTruth(store, truth.trajectories);
  if (!fit) return fit.error();
  evaluation.truth_fit = std::move(*fit);
  return evaluation;
}

json toJson(const TrajectoryEvaluation& evaluation) {
  return {{"ate_rmse_m", evaluation.ate.rmse_m},       {"ate_mean_m", evaluation.ate.mean_m},
          {"ate_median_m", evaluation.ate.median_m},   {"ate_max_m", evaluation.ate.max_m},
          {"ate_pairs", evaluation.ate.pairs},         {"trajectory_poses", evaluation.poses},
          {"rpe_frame", toJson(evaluation.rpe_frame)}, {"rpe_1s", toJson(evaluation.rpe_second)}};
}

Result<json> updateReport(const std::string& run, const RunEvaluation& evaluation) {
  auto read = readReport(run);
  if (!read) return read.error();
  json report = std::move(*read);
  for (auto& [name, entry] : report["robots"].items()) {
    // Numbers of an earlier evaluation must not stand beside those of this one.
    entry["ate_rmse_m"] = nullptr;
    entry["joint_ate_rmse_m"] = nullptr;
    entry.erase("ate_reason");
  }
  for (const auto& [name, robot] : evaluation.robots) {
    auto& entry = report["robots"][name];
    if (robot.own_reason.empty()) {
      entry.update(toJson(robot.own));
    } else {
      entry["ate_pairs"] = robot.own.pairs.size();
      entry["ate_reason"] = robot.own_reason;
    }
    entry["joint_ate_rmse_m"] = robot.joint_rmse_m ? json(*robot.joint_rmse_m) : json(nullptr);
  }
  report["joint_ate_rmse_m"] = evaluation.joint ? json(evaluation.joint->rmse_m) : json(nullptr);
  report.erase("joint_ate_reason");
  if (!evaluation.joint) report["joint_ate_reason"] = evaluation.joint_reason;
  report.erase("surface_reason");
  if (evaluation.surface) {
    const auto& s = *evaluation.surface;
    report["surface"] = {{"accuracy_mean_m", s.accuracy_mean_m},   {"accuracy_median_m", s.accuracy_median_m},
                         {"accuracy_p90_m", s.accuracy_p90_m},     {"point_mean_m", s.point_mean_m},
                         {"completeness_2cm", s.completeness_2cm}, {"map_points", s.map_points},
                         {"truth_points", s.truth_points},         {"truth_points_seen", s.truth_points_seen}};
    report["surface"]["completeness_seen_2cm"] = s.truth_points_seen ? json(s.completeness_seen_2cm) : json(nullptr);
    report["surface"]["covered_seen_2cm"] = s.truth_points_seen ? json(s.covered_seen_2cm) : json(nullptr);
  } else {
    report["surface"] = nullptr;
    report["surface_reason"] = evaluation.surface_reason;
  }
  report["double_surface"] = evaluation.doubles ? json(evaluation.doubles->share()) : json(nullptr);

  report.erase("closures_reason");
  report["closures"] = evaluation.closures ? toJson(*evaluation.closures) : json(nullptr);
  if (!evaluation.closures) report["closures_reason"] = evaluation.closures_reason;
  report["truth_fit"] = evaluation.truth_fit ? toJson(*evaluation.truth_fit) : json(nullptr);

  if (auto written = writeWholeFile(run + "/errors.csv", errorsCsv(poseErrors(evaluation))); !written)
    return written.error();
  if (auto written = writeWholeFile(reportPath(run), report.dump(2) + "\n"); !written) return written.error();
  return report;
}

}  // namespace comap
