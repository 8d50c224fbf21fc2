// What an agent says about its run when it ends: a JSON file for tools.
#pragma once

#include <string>
#include <vector>

#include "edge_agent/agent.h"

namespace comap {

struct AgentReport {
  std::string robot;
  uint64_t session = 0;
  uint32_t frames = 0, keyframes = 0, unacknowledged = 0;
  uint32_t damaged_frames = 0, poor_frames = 0, lost_frames = 0;
  uint64_t uplink_bytes = 0, tile_bytes_received = 0, tiles_received = 0;
  uint64_t tiles_held = 0, surfels_held = 0;
  MapId map;  ///< the robot's map as it was last told; empty if never
  double odometry_ms_median = 0, odometry_ms_p95 = 0;
  double duration_s = 0;  ///< from the first frame's stamp to the last one's
  std::vector<FrameRecord> trajectory;
};

AgentReport reportOf(const std::string& robot, const Agent& agent);

/// Writes to a temporary name first: a file that is there is whole.
Result<void> writeAgentReport(const AgentReport& report, const std::string& path);
Result<AgentReport> readAgentReport(const std::string& path);

/// The q-quantile (0..1) of values in any order; 0 for none.
double quantile(std::vector<double> values, double q);

}  // namespace comap
