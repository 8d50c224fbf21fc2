// Both modes on the same input.
#pragma once

#include "fleet_tools/evaluate/evaluate.h"
#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/run_series.h"

namespace comap {

struct CompareOptions {
  RunTruth truth;         ///< a robot that it has no trajectory of: groundtruth.txt of its source, if there is one
  bool alone = false;     ///< also each robot by itself
  bool sets = false;      ///< also every smaller set of robots
  bool ablation = false;  ///< of all robots also the paper mode with each remedy by itself, and with all
};

/// How many runs that will be.
size_t runsOf(const std::vector<ReplayRobot>& robots, const CompareOptions& compare);

/// Runs and evaluates into OUT/graph and OUT/paper (smaller sets of robots: OUT/alone-NAME/graph, OUT/set-a+b/graph
/// ...; remedies: OUT/fix-NAME, OUT/fix-all), writes OUT/compare.json and compare.html, and returns the former. Runs
/// that `series`, of OUT, knows as finished are not run again.
Result<nlohmann::json> replayCompare(const ReplayOptions& options, const PaperOptions& paper,
                                     const CompareOptions& compare, RunSeries& series, const ReplayProgress& progress);

}  // namespace comap
