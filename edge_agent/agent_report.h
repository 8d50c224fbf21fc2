// What an agent says about its run when it ends: a JSON file for tools.
#pragma once

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "edge_agent/agent.h"

namespace comap {

struct AgentReport {
  std::string robot;
  uint64_t session = 0;
  uint32_t frames = 0, keyframes = 0;
  uint32_t unacknowledged = 0;                            ///< keyframes, those of earlier sessions included
  uint32_t keyframes_thinned = 0, keyframes_dropped = 0;  ///< for want of room in the outbox
  uint32_t keyframes_damaged = 0;                         ///< lost with a damaged outbox
  uint32_t damaged_frames = 0, poor_frames = 0, lost_frames = 0;
  uint32_t chains = 0, relocalised = 0;  ///< starts without a link; times it saw, lost, a place that it knew
  std::optional<CaptureHealth> camera;   ///< of a live camera
  uint64_t uplink_bytes = 0, tile_bytes_received = 0, tiles_received = 0;
  uint64_t tiles_held = 0, surfels_held = 0;
  uint32_t registrations = 0;                             ///< against the tiles held, weighed in
  std::map<std::string, uint32_t> registrations_refused;  ///< by reason
  uint32_t recognised = 0, taken_back = 0;  ///< times a lost robot found itself in the tiles; and had been mistaken
  double corrected_m_mean = 0, corrected_m_worst = 0;  ///< how far a registration moved the live pose
  double registration_ms_median = 0, registration_ms_worst = 0;
  uint64_t tiles_forgotten = 0;  ///< for want of room
  uint64_t tiles_from_disk = 0;  ///< that did not have to come over the link
  uint64_t tiles_hash = 0;       ///< of the tiles held, see TileHash
  MapId map;                     ///< the robot's map as it was last told; empty if never
  double odometry_ms_median = 0, odometry_ms_p95 = 0, odometry_ms_worst = 0;
  double most_behind_s = 0;  ///< a recording's own speed, where it was played at that
  double duration_s = 0;     ///< from the first tracked frame's stamp to the last one's
  std::vector<FrameRecord> trajectory;
};

/// All but the trajectory, which the agent does not keep.
AgentReport reportOf(const std::string& robot, const Agent& agent);

/// A report on its way to disk: frames go into the file as they come, so that a long run costs no memory. It is
/// written under the name PATH.part, so a file that is there is whole. Thread rule: one thread.
class AgentReportFile {
 public:
  /// kUnreachable if PATH cannot be written or is no regular file.
  static Result<AgentReportFile> create(const std::string& path);

  /// Appends to the trajectory. A disk that takes no more is told by finish.
  void add(const FrameRecord& frame);

  /// Adds the rest of the report, whose own trajectory is not looked at, and gives the file its name. Call once.
  /// kUnreachable if anything could not be written; what was there before is then still there.
  Result<void> finish(const AgentReport& report);

  AgentReportFile(AgentReportFile&&) = default;
  AgentReportFile& operator=(AgentReportFile&&) = delete;
  /// Removes what was not finished.
  ~AgentReportFile();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  AgentReportFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}
  void put(const std::string& text);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;  // none once finished or moved from
  bool empty_ = true;
  int problem_ = 0;  // errno of the first write that failed
};

/// kUnreachable if there is no such file, kBadData if it is no agent's report.
Result<AgentReport> readAgentReport(const std::string& path);

}  // namespace comap
