#include "fleet_tools/evaluate/errors_csv.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "protocol/types/ids.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr const char* kHead = "robot,stamp_ns,error_m,true_x_m,true_y_m,true_z_m";
constexpr size_t kColumns = 6;

std::vector<std::string> cellsOf(const std::string& line) {
  std::vector<std::string> cells;
  for (size_t at = 0; at <= line.size();) {
    const size_t end = std::min(line.find(',', at), line.size());
    cells.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  return cells;
}

template <typename Number>
bool parse(const std::string& text, Number& value) {
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::map<std::string, std::vector<PoseError>> poseErrors(const RunEvaluation& evaluation) {
  std::map<std::string, std::vector<PoseError>> errors;
  for (const auto& [name, robot] : evaluation.robots) {
    if (!evaluation.joint && !robot.own_reason.empty()) continue;  // nothing to align by
    const Pose& T_truth_map = evaluation.joint ? evaluation.joint->T_truth_estimate : robot.own.ate.T_truth_estimate;
    const Pose T_map_truth = T_truth_map.inverse();
    for (const PosePair& pair : robot.own.pairs) {
      const Eigen::Vector3d truth = T_map_truth * pair.truth.pose.translation();
      errors[name].push_back({pair.estimate.stamp_ns, (pair.estimate.pose.translation() - truth).norm(), truth});
    }
  }
  return errors;
}

std::string errorsCsv(const std::map<std::string, std::vector<PoseError>>& errors) {
  std::string text = std::string(kHead) + "\n";
  for (const auto& [robot, poses] : errors)
    for (const PoseError& pose : poses) {
      const Eigen::Vector3d& p = pose.true_position_m;
      text +=
          fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.6f}\n", robot, pose.stamp_ns, pose.error_m, p.x(), p.y(), p.z());
    }
  return text;
}

Result<std::map<std::string, std::vector<PoseError>>> readErrorsCsv(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  std::string line;
  if (!std::getline(file, line) || line != kHead)
    return Error{ErrorCode::kBadData, path + ": line 1: expected '" + std::string(kHead) + "'"};
  std::map<std::string, std::vector<PoseError>> errors;
  for (size_t number = 2; std::getline(file, line); ++number) {
    const auto where = [&] { return path + ": line " + std::to_string(number) + ": "; };
    const std::vector<std::string> cells = cellsOf(line);
    if (cells.size() != kColumns)
      return Error{ErrorCode::kBadData, where() + std::to_string(cells.size()) + " columns, expected 6"};
    if (const auto problem = robotNameProblem(cells[0]); !problem.empty())
      return Error{ErrorCode::kBadData, where() + problem};
    PoseError pose;
    if (!parse(cells[1], pose.stamp_ns))
      return Error{ErrorCode::kBadData, where() + "stamp_ns '" + cells[1] + "', expected nanoseconds"};
    std::array<double, 4> values{};
    for (size_t i = 0; i < values.size(); ++i)
      if (!parse(cells[i + 2], values[i]) || !std::isfinite(values[i]))
        return Error{ErrorCode::kBadData, where() + "column " + std::to_string(i + 3) + ": '" + cells[i + 2] +
                                              "', expected a finite number of metres"};
    pose.error_m = values[0];
    pose.true_position_m = {values[1], values[2], values[3]};
    errors[cells[0]].push_back(pose);
  }
  return errors;
}

}  // namespace comap
