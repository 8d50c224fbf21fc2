#include "fleet_tools/evaluate/evaluate_paper.h"

#include "fleet_tools/evaluate/metrics_trajectory.h"

namespace comap {
namespace {

using nlohmann::json;
using Trajectory = std::vector<StampedPose>;

struct SeenFrame {
  std::string robot;
  int64_t stamp_ns = 0;
};

std::optional<Pose> poseOf(const json& values) {
  if (!values.is_array() || values.size() != 7) return std::nullopt;
  double v[7];
  for (size_t i = 0; i < 7; ++i) {
    if (!values[i].is_number()) return std::nullopt;
    v[i] = values[i].get<double>();
  }
  const Pose pose(Eigen::Quaterniond(v[6], v[3], v[4], v[5]), Eigen::Vector3d(v[0], v[1], v[2]));
  return pose.isFinite() ? std::optional<Pose>(pose) : std::nullopt;
}

std::optional<SeenFrame> frameOf(const json& values) {
  if (!values.is_object() || !values.contains("robot") || !values["robot"].is_string() ||
      !values.contains("stamp_ns") || !values["stamp_ns"].is_number_integer())
    return std::nullopt;
  return SeenFrame{values["robot"].get<std::string>(), values["stamp_ns"].get<int64_t>()};
}

std::optional<Pose> truthAt(const std::map<std::string, Trajectory>& truths, const SeenFrame& frame) {
  const auto found = truths.find(frame.robot);
  if (found == truths.end()) return std::nullopt;
  const auto pairs = associate({{frame.stamp_ns, Pose()}}, found->second);
  return pairs.empty() ? std::nullopt : std::optional<Pose>(pairs.front().truth.pose);
}

}  // namespace

Result<ClosureScore> evaluatePaperMerges(const json& report, const std::map<std::string, std::string>& truths,
                                         const ClosureBounds& bounds) {
  std::map<std::string, Trajectory> trajectories;
  for (const auto& [robot, file] : truths) {
    auto read = readTrajectory(file);
    if (!read) return read.error();
    trajectories[robot] = std::move(*read);
  }
  const auto merges = report.find("merges");
  if (merges == report.end() || !merges->is_array()) return Error{ErrorCode::kBadData, "report has no list 'merges'"};
  ClosureScore score;
  for (const json& merge : *merges) {
    const auto part = [&](const char* key) { return merge.is_object() && merge.contains(key) ? merge[key] : json(); };
    const auto query = frameOf(part("query")), place = frameOf(part("place"));
    const auto T_place_query = poseOf(part("T_place_query"));
    if (!query || !place || !T_place_query)
      return Error{ErrorCode::kBadData,
                   "report: merge " + std::to_string(score.merges + 1) + " lacks query, place or T_place_query"};
    ++score.merges;
    const auto T_world_query = truthAt(trajectories, *query), T_world_place = truthAt(trajectories, *place);
    if (!T_world_query || !T_world_place) continue;
    ++score.accepted;
    const bool right = isRight(T_world_place->inverse() * *T_world_query, *T_place_query, bounds);
    score.right += right;
    score.false_merges += !right;
    score.false_merges_standing += !right;
    if (!right || score.first_merge_s || trajectories[query->robot].empty()) continue;
    score.first_merge_s = 1e-9 * static_cast<double>(query->stamp_ns - trajectories[query->robot].front().stamp_ns);
  }
  return score;
}

}  // namespace comap
