// The whole system on recorded data: one process in a fixed order, or real processes over real DDS.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "edge_agent/agent_report.h"
#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/paper/paper_options.h"
#include "mapping_core/service/core_report.h"

namespace comap {

struct ReplayRobot {
  std::string name;
  std::string source;  ///< DIR[@FIRST:LAST]
};

struct ReplayOptions {
  std::vector<ReplayRobot> robots;
  std::string out;  ///< folder that exists
  std::string device = "auto";
  uint32_t fern_seed = FernBook::kStandardSeed;
  bool realtime = false;
  std::string keys;  ///< folder of the site's keys (`fleet keys`), for DDS; empty: clear text
  int domain = -1;   ///< DDS domain; -1 = one of 100..219 by process id, so that runs do not meet
};

struct ReplayOutcome {
  std::vector<AgentReport> robots;
  CoreReport core;
  double wall_s = 0;
};

using ReplayProgress = std::function<void(const std::string& stage, size_t done, size_t all)>;

/// Robots take turns frame by frame and the core maps in between: same input, same bits on one device.
Result<ReplayOutcome> replayLoopback(const ReplayOptions& options, const ReplayProgress& progress);

/// Starts mapping_core and one edge_agent a robot from the folder of this program; they talk over loopback DDS.
/// Ends the processes it started, whatever happens.
Result<ReplayOutcome> replayDds(const ReplayOptions& options, const ReplayProgress& progress);

/// A run of the paper mode, measured and written to `options.out`: report.json's content. Over loopback only; every
/// frame goes to the core.
Result<nlohmann::json> replayPaper(const ReplayOptions& options, const PaperOptions& paper,
                                   const ReplayProgress& progress);

}  // namespace comap
