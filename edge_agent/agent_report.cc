#include "edge_agent/agent_report.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr char kUnfinished[] = ".part";

Error cannotWrite(const std::string& path, int problem) {
  return {ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(problem)};
}

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

Json toJson(const StreamHealth& stream) {
  return {{"state", toString(stream.state)}, {"problem", stream.problem},         {"taken", stream.taken},
          {"damaged", stream.damaged},       {"missed", stream.missed},           {"repeated", stream.repeated},
          {"reopened", stream.reopened},     {"clock_jumps", stream.clock_jumps}, {"stalls", stream.stalls}};
}

// For people and tools outside; nothing here reads it back.
Json toJson(const CaptureHealth& camera) {
  return {{"colour", toJson(camera.colour)},
          {"depth", toJson(camera.depth)},
          {"overtaken", camera.overtaken},
          {"unpaired", camera.unpaired},
          {"not_decoded", camera.not_decoded},
          {"every", camera.every},
          {"hottest_celsius", camera.hottest_C ? Json(*camera.hottest_C) : Json()}};
}

}  // namespace

AgentReport reportOf(const std::string& robot, const Agent& agent) {
  const AgentStatistics& s = agent.statistics();
  AgentReport report;
  report.robot = robot;
  report.session = agent.session();
  report.frames = s.frames;
  report.keyframes = s.keyframes;
  report.unacknowledged = agent.unacknowledged();
  report.keyframes_thinned = agent.losses().thinned;
  report.keyframes_dropped = agent.losses().dropped;
  report.keyframes_damaged = agent.losses().damaged;
  report.damaged_frames = s.damaged_frames;
  report.poor_frames = s.poor_frames;
  report.lost_frames = s.lost_frames;
  report.chains = s.chains;
  report.relocalised = s.relocalised;
  report.camera = agent.captureHealth();
  report.uplink_bytes = agent.uplinkBytes();
  report.tile_bytes_received = s.tile_bytes_received;
  report.tiles_received = s.tiles_received;
  report.tiles_held = agent.tiles().tiles().size();
  report.surfels_held = agent.tiles().surfels();
  const LocalizerStatistics& l = agent.localizer().statistics();
  report.registrations = l.registered;
  report.registrations_refused = l.refused;
  report.recognised = l.recognised;
  report.taken_back = l.taken_back;
  report.corrected_m_mean = l.registered > 0 ? l.corrected_m_sum / l.registered : 0;
  report.corrected_m_worst = l.corrected_m_worst;
  report.registration_ms_median = s.localizer_ms.quantile_ms(0.5);
  report.registration_ms_worst = s.localizer_ms.worst_ms();
  report.tiles_from_disk = agent.tiles().fromDisk();
  report.tiles_forgotten = agent.tiles().forgotten();
  report.tiles_hash = agent.tiles().hash();
  if (agent.correction()) report.map = agent.correction()->map;
  report.odometry_ms_median = s.odometry_ms.quantile_ms(0.5);
  report.odometry_ms_p95 = s.odometry_ms.quantile_ms(0.95);
  report.odometry_ms_worst = s.odometry_ms.worst_ms();
  report.duration_s = static_cast<double>(s.last_stamp_ns - s.first_stamp_ns) * 1e-9;
  return report;
}

Result<AgentReportFile> AgentReportFile::create(const std::string& path) {
  struct stat there {};
  if (stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode))
    return Error{ErrorCode::kUnreachable, path + ": is no regular file"};
  std::FILE* file = std::fopen((path + kUnfinished).c_str(), "wb");
  if (file == nullptr) return cannotWrite(path, errno);
  AgentReportFile report(path, file);
  report.put("{\"trajectory\":[");
  return report;
}

AgentReportFile::~AgentReportFile() {
  if (file_) std::remove((path_ + kUnfinished).c_str());
}

void AgentReportFile::put(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() && problem_ == 0) problem_ = errno;
}

void AgentReportFile::add(const FrameRecord& frame) {
  put((empty_ ? "\n" : ",\n") + toJson(frame).dump());
  empty_ = false;
}

Result<void> AgentReportFile::finish(const AgentReport& r) {
  const Json json = {{"robot", r.robot},
                     {"session", r.session},
                     {"frames", r.frames},
                     {"keyframes", r.keyframes},
                     {"unacknowledged", r.unacknowledged},
                     {"keyframes_thinned", r.keyframes_thinned},
                     {"keyframes_dropped", r.keyframes_dropped},
                     {"keyframes_damaged", r.keyframes_damaged},
                     {"damaged_frames", r.damaged_frames},
                     {"poor_frames", r.poor_frames},
                     {"lost_frames", r.lost_frames},
                     {"chains", r.chains},
                     {"relocalised", r.relocalised},
                     {"uplink_bytes", r.uplink_bytes},
                     {"tile_bytes_received", r.tile_bytes_received},
                     {"tiles_received", r.tiles_received},
                     {"tiles_held", r.tiles_held},
                     {"surfels_held", r.surfels_held},
                     {"registrations", r.registrations},
                     {"registrations_refused", r.registrations_refused},
                     {"recognised", r.recognised},
                     {"taken_back", r.taken_back},
                     {"corrected_m_mean", r.corrected_m_mean},
                     {"corrected_m_worst", r.corrected_m_worst},
                     {"registration_ms_median", r.registration_ms_median},
                     {"registration_ms_worst", r.registration_ms_worst},
                     {"tiles_forgotten", r.tiles_forgotten},
                     {"tiles_from_disk", r.tiles_from_disk},
                     {"tiles_hash", r.tiles_hash},
                     {"map", r.map},
                     {"odometry_ms_median", r.odometry_ms_median},
                     {"odometry_ms_p95", r.odometry_ms_p95},
                     {"odometry_ms_worst", r.odometry_ms_worst},
                     {"most_behind_s", r.most_behind_s},
                     {"duration_s", r.duration_s},
                     {"camera", r.camera ? toJson(*r.camera) : Json()}};
  put("],\n" + json.dump().substr(1) + "\n");
  if (std::fflush(file_.get()) != 0 && problem_ == 0) problem_ = errno;
  if (auto free = checkReplaceable(path_, FileKind::kJson); !free)
    return free;  // the outbox may be one that was made after the start
  if (problem_ == 0 && std::rename((path_ + kUnfinished).c_str(), path_.c_str()) != 0) problem_ = errno;
  if (problem_ != 0) return cannotWrite(path_, problem_);
  file_.reset();
  return {};
}

Result<AgentReport> readAgentReport(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
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
    r.keyframes_thinned = json.at("keyframes_thinned").get<uint32_t>();
    r.keyframes_dropped = json.at("keyframes_dropped").get<uint32_t>();
    r.keyframes_damaged = json.at("keyframes_damaged").get<uint32_t>();
    r.damaged_frames = json.at("damaged_frames").get<uint32_t>();
    r.poor_frames = json.at("poor_frames").get<uint32_t>();
    r.lost_frames = json.at("lost_frames").get<uint32_t>();
    r.chains = json.at("chains").get<uint32_t>();
    r.relocalised = json.at("relocalised").get<uint32_t>();
    r.uplink_bytes = json.at("uplink_bytes").get<uint64_t>();
    r.tile_bytes_received = json.at("tile_bytes_received").get<uint64_t>();
    r.tiles_received = json.at("tiles_received").get<uint64_t>();
    r.tiles_held = json.at("tiles_held").get<uint64_t>();
    r.surfels_held = json.at("surfels_held").get<uint64_t>();
    r.registrations = json.at("registrations").get<uint32_t>();
    r.registrations_refused = json.at("registrations_refused").get<std::map<std::string, uint32_t>>();
    r.recognised = json.at("recognised").get<uint32_t>();
    r.taken_back = json.at("taken_back").get<uint32_t>();
    r.corrected_m_mean = json.at("corrected_m_mean").get<double>();
    r.corrected_m_worst = json.at("corrected_m_worst").get<double>();
    r.registration_ms_median = json.at("registration_ms_median").get<double>();
    r.registration_ms_worst = json.at("registration_ms_worst").get<double>();
    r.tiles_forgotten = json.at("tiles_forgotten").get<uint64_t>();
    r.tiles_from_disk = json.at("tiles_from_disk").get<uint64_t>();
    r.tiles_hash = json.at("tiles_hash").get<uint64_t>();
    r.map = json.at("map").get<std::string>();
    r.odometry_ms_median = json.at("odometry_ms_median").get<double>();
    r.odometry_ms_p95 = json.at("odometry_ms_p95").get<double>();
    r.odometry_ms_worst = json.at("odometry_ms_worst").get<double>();
    r.most_behind_s = json.value("most_behind_s", 0.0);  // not in those of earlier releases
    r.duration_s = json.at("duration_s").get<double>();
    for (const Json& frame : json.at("trajectory")) r.trajectory.push_back(frameOf(frame));
    return r;
  } catch (const Json::exception& problem) {
    return Error{ErrorCode::kBadData, path + ": not an agent's report: " + problem.what()};
  }
}

}  // namespace comap
