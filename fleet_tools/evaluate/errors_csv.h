// errors.csv: the position error of each evaluated pose of a run, and where the truth has it in the map.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "fleet_tools/evaluate/evaluate.h"

namespace comap {

struct PoseError {
  int64_t stamp_ns = 0;
  double error_m = 0;
  Eigen::Vector3d true_position_m;  ///< in the frame of the estimate
};

/// Of each robot in order of time: under the joint alignment if there is one, else under each robot's own.
std::map<std::string, std::vector<PoseError>> poseErrors(const RunEvaluation& evaluation);

/// The file's text: a head and a line a pose.
std::string errorsCsv(const std::map<std::string, std::vector<PoseError>>& errors);

/// Reads such a file. kUnreachable; kBadData with file, line and column.
Result<std::map<std::string, std::vector<PoseError>>> readErrorsCsv(const std::string& path);

}  // namespace comap
