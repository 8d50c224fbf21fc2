#include "edge_agent/agent_report.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Json = nlohmann::json;

Json toJson(const FrameRecord& frame) {
  const auto& t = frame.T_keyframe_cam.translation();
  const auto& q = frame.T_keyframe_cam.rotation();
  return Json::array(
      {frame.stamp_ns, frame.keyframe, static_cast<int>(frame.state), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
}

FrameRecord frameOf(const Json& json) {
  FrameRecord frame;
  frame.stamp_ns = json.at(0).get<int64_t>();
  frame.keyframe = json.at(1).get<uint32_t>();
  frame.state = static_cast<TrackingState>(json.at(2).get<int>());
  frame.T_keyframe_cam =
      Pose(Eigen::Quaterniond(json.at(9).get<double>(), json.at(6).get<double>(), json.at(7).get<double>(),
                              json.at(8).get<double>()),
           Eigen::Vector3d(json.at(3).get<double>(), json.at(4).get<double>(), json.at(5).get<double>()));
  return frame;
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const size_t k = std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<long>(k), values.end());
  return values[k];
}

AgentReport reportOf(const std::string& robot, const Agent& agent) {
  const AgentStatistics& s = agent.statistics();
  AgentReport report;
  report.robot = robot;
  report.session = agent.session();
  report.frames = s.frames;
  report.keyframes = s.keyframes;
  report.unacknowledged = agent.unacknowledged();
  report.damaged_frames = s.damaged_frames;
  report.poor_frames = s.poor_frames;
  report.lost_frames = s.lost_frames;
  report.uplink_bytes = agent.uplinkBytes();
  report.tile_bytes_received = s.tile_bytes_received;
  report.tiles_received = s.tiles_received;
  report.tiles_held = agent.tiles().tiles().size();
  report.surfels_held = agent.tiles().surfels();
  if (agent.correction()) report.map = agent.correction()->map;
  report.odometry_ms_median = quantile(s.odometry_ms, 0.5);
  report.odometry_ms_p95 = quantile(s.odometry_ms, 0.95);
  report.trajectory = agent.frames();
  if (!report.trajectory.empty())
    report.duration_s =
        static_cast<double>(report.trajectory.back().stamp_ns - report.trajectory.front().stamp_ns) * 1e-9;
  return report;
}

Result<void> writeAgentReport(const AgentReport& r, const std::string& path) {
  Json json = {{"robot", r.robot},
               {"session", r.session},
               {"frames", r.frames},
               {"keyframes", r.keyframes},
               {"unacknowledged", r.unacknowledged},
               {"damaged_frames", r.damaged_frames},
               {"poor_frames", r.poor_frames},
               {"lost_frames", r.lost_frames},
               {"uplink_bytes", r.uplink_bytes},
               {"tile_bytes_received", r.tile_bytes_received},
               {"tiles_received", r.tiles_received},
               {"tiles_held", r.tiles_held},
               {"surfels_held", r.surfels_held},
               {"map", r.map},
               {"odometry_ms_median", r.odometry_ms_median},
               {"odometry_ms_p95", r.odometry_ms_p95},
               {"duration_s", r.duration_s}};
  json["trajectory"] = Json::array();
  for (const FrameRecord& frame : r.trajectory) json["trajectory"].push_back(toJson(frame));
  return writeWholeFile(path, json.dump() + "\n");
}

Result<AgentReport> readAgentReport(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": no such file, or it cannot be read"};
  try {
    const Json json = Json::parse(file);
    AgentReport r;
    r.robot = json.at("robot").get<std::string>();
    r.session = json.at("session").get<uint64_t>();
    r.frames = json.at("frames").get<uint32_t>();
    r.keyframes = json.at("keyframes").get<uint32_t>();
    r.unacknowledged = json.at("unacknowledged").get<uint32_t>();
    r.damaged_frames = json.at("damaged_frames").get<uint32_t>();
    r.poor_frames = json.at("poor_frames").get<uint32_t>();
    r.lost_frames = json.at("lost_frames").get<uint32_t>();
    r.uplink_bytes = json.at("uplink_bytes").get<uint64_t>();
    r.tile_bytes_received = json.at("tile_bytes_received").get<uint64_t>();
    r.tiles_received = json.at("tiles_received").get<uint64_t>();
    r.tiles_held = json.at("tiles_held").get<uint64_t>();
    r.surfels_held = json.at("surfels_held").get<uint64_t>();
    r.map = json.at("map").get<std::string>();
    r.odometry_ms_median = json.at("odometry_ms_median").get<double>();
    r.odometry_ms_p95 = json.at("odometry_ms_p95").get<double>();
    r.duration_s = json.at("duration_s").get<double>();
    for (const Json& frame : json.at("trajectory")) r.trajectory.push_back(frameOf(frame));
    return r;
  } catch (const Json::exception& problem) {
    return Error{ErrorCode::kBadData, path + ": not an agent's report: " + problem.what()};
  }
}

}  // namespace comap
