// A finished run against the truth.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "fleet_tools/evaluate/evaluate_closures.h"
#include "fleet_tools/evaluate/metrics.h"
#include "fleet_tools/evaluate/metrics_doubles.h"
#include "fleet_tools/evaluate/metrics_surface.h"
#include "fleet_tools/evaluate/truth_fit.h"

namespace comap {

struct TrajectoryEvaluation {
  Ate ate;  ///< with the trajectory's own alignment
  std::optional<Rpe> rpe_frame, rpe_second;
  size_t poses = 0;  ///< of the trajectory; those without truth within 0.02 s are not evaluated
  std::vector<PosePair> pairs;
};

/// Both files in the TUM format. kProblem if fewer than three poses can be paired.
Result<TrajectoryEvaluation> evaluateTrajectory(const std::string& trajectory, const std::string& truth);

struct RobotEvaluation {
  TrajectoryEvaluation own;
  std::string own_reason;              ///< why there is no error of its own; empty if there is
  std::string map;                     ///< the map the robot ended in, empty if the report says none
  std::optional<double> joint_rmse_m;  ///< this robot's error under the joint alignment
};

struct RunEvaluation {
  std::map<std::string, RobotEvaluation> robots;
  std::optional<Ate> joint;
  std::string joint_reason;  ///< why there is no joint ATE
  std::optional<SurfaceScore> surface;
  std::string surface_reason;            ///< why there is none
  std::optional<DoubleSurface> doubles;  ///< none without run/map.ply
  std::optional<ClosureScore> closures;
  std::string closures_reason;        ///< why there is none
  std::optional<TruthFit> truth_fit;  ///< none without a store
};

struct RunTruth {
  std::map<std::string, std::string> trajectories;  ///< robot -> file
  std::string surface;                              ///< PLY, empty = none
  /// A robot with fewer than three poses that have truth goes without an error, with the reason, instead of kProblem.
  bool spare_short = false;
};

/// run/report.json, an object with an object `robots` of objects. kUnreachable or kBadData otherwise.
Result<nlohmann::json> readReport(const std::string& run);

/// Reads run/report.json, run/<robot>.trajectory.txt for each robot of `truth`, run/map.comap and run/map.ply
/// if there are.
/// Robots share the joint alignment only if the report has them in one map; else joint and surface are left out, with
/// the reason. Surface points are aligned by the joint alignment.
Result<RunEvaluation> evaluateRun(const std::string& run, const RunTruth& truth, int threads);

/// Adds the results to run/report.json (all else in it stays) by replacing the file as a whole, writes each pose's
/// error into run/errors.csv, and returns what the report now says: robots.<name>.ate_rmse_m and more,
/// joint_ate_rmse_m, surface.
Result<nlohmann::json> updateReport(const std::string& run, const RunEvaluation& evaluation);

/// The numbers of one trajectory under the report's names.
nlohmann::json toJson(const TrajectoryEvaluation& evaluation);

}  // namespace comap
